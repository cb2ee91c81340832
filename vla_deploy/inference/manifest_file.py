"""Read and write `model.toml`, the manifest in the folder of a model's files."""

import json
import math
import tomllib
from collections.abc import Iterator, Mapping
from dataclasses import asdict, is_dataclass
from enum import StrEnum
from pathlib import Path
from types import NoneType, UnionType
from typing import Any, Final, get_args, get_origin, get_type_hints

from vla_deploy.inference.errors import ManifestInvalid
from vla_deploy.inference.manifest import Manifest
from vla_deploy.inference.manifest_schema import manifest_faults

MANIFEST: Final = "model.toml"
Document = Mapping[str, Any]


def read_manifest(folder: Path) -> Manifest:
    """Return the manifest of a model's folder.

    Raises:
        ManifestInvalid: it is missing, is no TOML, or has faults; all of them are listed.
    """
    file = folder / MANIFEST
    try:
        document = tomllib.loads(file.read_text(encoding="utf-8"))
    except FileNotFoundError as error:
        raise ManifestInvalid(file, ("no such file; each model has one",)) from error
    except (OSError, tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise ManifestInvalid(file, (f"expected a TOML document: {error}",)) from error
    faults = tuple(str(fault) for fault in manifest_faults(document, folder.name))
    if faults:
        raise ManifestInvalid(file, faults)
    manifest: Manifest = _build(Manifest, document)
    return manifest


def write_manifest(folder: Path, manifest: Manifest) -> None:
    """Write the manifest of a model's folder; reading it gives the same again.

    Raises:
        OSError: the file cannot be written.
    """
    text = "\n".join(_lines("", document_of(manifest))).lstrip("\n")
    (folder / MANIFEST).write_text(text + "\n", encoding="utf-8")


def _build(kind: Any, value: Any) -> Any:
    """Return a checked value of a document as a manifest's types say; absent keys keep defaults."""
    choices = [one for one in get_args(kind) if one is not NoneType]
    origin = get_origin(kind)
    if origin is UnionType:
        return _build(choices[0], value) if len(choices) == 1 else value
    if origin is tuple:
        return tuple(_build(choices[0], one) for one in value)
    if origin is Mapping:
        return {_build(choices[0], key): _build(choices[1], one) for key, one in value.items()}
    if isinstance(kind, type) and is_dataclass(kind):
        types = get_type_hints(kind)
        return kind(**{key: _build(types[key], one) for key, one in value.items() if key in types})
    return kind(value) if issubclass(kind, StrEnum) else value


def document_of(manifest: Manifest) -> dict[str, Any]:
    """Return the manifest as tables; what is empty or absent is left out."""
    document = asdict(manifest, dict_factory=_present)
    return {key: value for key, value in document.items() if value not in ((), {})}


def _present(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    return {key: value for key, value in pairs if value not in ("", None)}


def _lines(prefix: str, table: Document) -> Iterator[str]:
    """Yield TOML: plain values first, then tables, then lists of tables."""
    for key, value in table.items():
        if not _is_nested(value):
            yield f"{key} = {_value(value)}"
    for key, value in table.items():
        name = f"{prefix}{key}"
        if isinstance(value, dict):
            if not all(_is_nested(inner) for inner in value.values()):
                yield f"\n[{name}]"
            yield from _lines(f"{name}.", value)
        elif _is_nested(value):
            for row in value:
                yield f"\n[[{name}]]"
                yield from _lines(f"{name}.", row)


def _is_nested(value: object) -> bool:
    rows = isinstance(value, tuple | list) and bool(value) and isinstance(value[0], dict)
    return isinstance(value, dict) or rows


def _value(value: object) -> str:
    """Return a plain value as TOML, which JSON's form is but for numbers that are none."""
    if isinstance(value, float) and not math.isfinite(value):
        return str(value)
    return json.dumps(value, ensure_ascii=False)
