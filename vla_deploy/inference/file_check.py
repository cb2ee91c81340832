"""Check that a model's files are those that were checked in."""

import hashlib
from pathlib import Path

from vla_deploy.inference.errors import ModelFileSpoiled
from vla_deploy.inference.manifest import ModelFile, Variant
from vla_deploy.inference.store import StoredModel


def checked_file(model: StoredModel, variant: Variant) -> Path:
    """Return the path of one of a model's files, whose content is what the manifest says.

    Raises:
        ModelFileSpoiled: it is missing, cannot be read, or its SHA-256 is another one.
    """
    return _checked(model.folder, model.manifest.files[variant])


def check_parts(model: StoredModel) -> None:
    """Check every part of a model that has several files.

    Raises:
        ModelFileSpoiled: one is missing, cannot be read, or its SHA-256 is another one.
    """
    for part in model.manifest.parts:
        _checked(model.folder, part)


def _checked(folder: Path, entry: ModelFile) -> Path:
    path = folder / entry.path
    got = sha256_of(path)
    if got != entry.sha256:
        raise ModelFileSpoiled(
            f"{path}: expected SHA-256 {entry.sha256}, got {got} over {path.stat().st_size} bytes; "
            "it was cut off or replaced: add the model again"
        )
    return path


def sha256_of(path: Path) -> str:
    """Return the SHA-256 of a file.

    Raises:
        ModelFileSpoiled: it is missing or cannot be read.
    """
    try:
        with path.open("rb") as file:
            return hashlib.file_digest(file, "sha256").hexdigest()
    except OSError as error:
        raise ModelFileSpoiled(f"{path}: {error.strerror or error}") from error
