"""Read and write `model.toml`, the manifest in the folder of a model's files."""

import json
import math
import tomllib
from collections.abc import Iterator, Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any, Final

from vla_deploy.inference.errors import ManifestInvalid
from vla_deploy.inference.manifest import Manifest
from vla_deploy.inference.manifest_schema import manifest_faults
from vla_deploy.runtime.table_schema import build, parse_toml

MANIFEST: Final = "model.toml"
Document = Mapping[str, Any]


def read_manifest(folder: Path) -> Manifest:
    """Return the manifest of a model's folder.

    Raises:
        ManifestInvalid: it is missing, is no TOML, or has faults; all of them are listed.
    """
    file = folder / MANIFEST
    try:
        document = parse_toml(file.read_text(encoding="utf-8"))
    except FileNotFoundError as error:
        raise ManifestInvalid(file, ("no such file; each model has one",)) from error
    except (OSError, tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise ManifestInvalid(file, (f"expected a TOML document: {error}",)) from error
    faults = tuple(str(fault) for fault in manifest_faults(document, folder.name))
    if faults:
        raise ManifestInvalid(file, faults)
    return build(Manifest, document)


def write_manifest(folder: Path, manifest: Manifest) -> None:
    """Write the manifest of a model's folder; reading it gives the same again.

    Raises:
        OSError: the file cannot be written.
    """
    text = "\n".join(_lines("", document_of(manifest))).lstrip("\n")
    (folder / MANIFEST).write_text(text + "\n", encoding="utf-8")


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
