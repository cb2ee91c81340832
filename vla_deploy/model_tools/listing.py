"""List models: where they come from, how large they are, and which profiles use them."""

from collections import defaultdict
from pathlib import Path
from typing import Any, Final

from platforms import load_profile
from platforms.profile import profile_names
from vla_deploy.inference.errors import InferenceError
from vla_deploy.inference.store import ModelStore

_BYTES_PER_MB: Final = 2**20
_WEIGHTS: Final = (".bin", ".onnx", ".data", "_data")


def profile_uses() -> dict[str, list[str]]:
    """Return where profiles name each model, as "profile role tier N"."""
    uses: dict[str, list[str]] = defaultdict(list)
    for name in profile_names():
        for role, choice in load_profile(name).models.items():
            for tier, model in enumerate(choice.tiers):
                uses[model].append(f"{name} {role} tier {tier}")
    return dict(uses)


def model_rows(store: ModelStore) -> list[dict[str, Any]]:
    """Return a JSON row for each model of the store, and each that only profiles name."""
    uses, names = profile_uses(), store.names()
    rows = [_row(store, name, uses.get(name, [])) for name in names]
    return rows + [_missing_row(name, uses[name]) for name in sorted(uses.keys() - set(names))]


def _row(store: ModelStore, name: str, used_by: list[str]) -> dict[str, Any]:
    try:
        model = store.load(name)
    except InferenceError as error:
        fault = str(error).partition("\n")[0]
        return {**_missing_row(name, used_by), "from": "spoiled", "fault": fault}
    manifest = model.manifest
    sizes = {
        str(variant): _size_mb(model.folder / file.path) for variant, file in manifest.files.items()
    }
    sizes |= {
        part.path: _size_mb(model.folder / part.path)
        for part in manifest.parts
        if part.path.endswith(_WEIGHTS)
    }
    return {
        "name": name,
        "role": manifest.role,
        "from": "software" if model.is_embedded else "added",
        "files": sizes,
        "licence": manifest.licence,
        "used_by": used_by,
        "fault": "",
    }


def _missing_row(name: str, used_by: list[str]) -> dict[str, Any]:
    return {
        "name": name,
        "role": used_by[0].split()[1] if used_by else "",
        "from": "missing",
        "files": {},
        "licence": "",
        "used_by": used_by,
        "fault": "named by profiles only",
    }


def _size_mb(path: Path) -> float | None:
    return round(path.stat().st_size / _BYTES_PER_MB, 2) if path.is_file() else None
