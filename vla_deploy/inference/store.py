"""Find models, those of the software and those that a person has added, and check their files."""

import hashlib
import os
import shutil
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final

from vla_deploy.inference.errors import ModelFileSpoiled, ModelUnknown
from vla_deploy.inference.manifest import Manifest, ModelFile, Variant
from vla_deploy.inference.manifest_file import MANIFEST, read_manifest
from vla_deploy.inference.manifest_schema import is_name

EMBEDDED: Final = Path(__file__).resolve().parent.parent / "models"


@dataclass(frozen=True, slots=True, kw_only=True)
class StoredModel:
    """Hold a model's manifest and the folder that its files lie in."""

    manifest: Manifest
    folder: Path
    is_embedded: bool = False

    def checked_file(self, variant: Variant) -> Path:
        """Return the path of a file, whose content is what the manifest says.

        Raises:
            ModelFileSpoiled: it is missing, cannot be read, or its SHA-256 is another one.
        """
        return self._checked(self.manifest.files[variant])

    def check_parts(self) -> None:
        """Check every part of a model that has several files.

        Raises:
            ModelFileSpoiled: one is missing, cannot be read, or its SHA-256 is another one.
        """
        for part in self.manifest.parts:
            self._checked(part)

    def only(self, variant: Variant) -> "StoredModel":
        """Return the model with no file but one, so that every precision takes that."""
        files = {variant: self.manifest.files[variant]}
        return replace(self, manifest=replace(self.manifest, files=files))

    def _checked(self, entry: ModelFile) -> Path:
        path = self.folder / entry.path
        got = sha256_of(path)
        if got != entry.sha256:
            raise ModelFileSpoiled(
                f"{path}: expected SHA-256 {entry.sha256}, got {got} over {path.stat().st_size} "
                "bytes; it was cut off or replaced: add the model again"
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


class ModelStore:
    """Look models up by name: embedded ones, then added ones; no name is in both.

    With `system` those that root has added are found, too, where a person has not.
    """

    def __init__(self, user: Path, embedded: Path = EMBEDDED, system: Path | None = None) -> None:
        self.user = user
        self.embedded = embedded
        self._added = (user,) if system in (None, user) else (user, system)

    def names(self) -> tuple[str, ...]:
        """Return the name of every model, sorted; a spoiled manifest has one too."""
        folders = (self.embedded, *self._added)
        return tuple(sorted({name for folder in folders for name in _names(folder)}))

    def load(self, name: str) -> StoredModel:
        """Return a model by its name.

        Raises:
            ModelUnknown: there is none of that name.
            ManifestInvalid: its manifest has faults.
        """
        places = ((self.embedded, True), *((added, False) for added in self._added))
        for folder, is_embedded in ((place / name, embedded) for place, embedded in places):
            if is_name(name) and (folder / MANIFEST).is_file():
                manifest = read_manifest(folder)
                return StoredModel(manifest=manifest, folder=folder, is_embedded=is_embedded)
        known = ", ".join(self.names()) or "none"
        raise ModelUnknown(
            f"no model {name!r}: expected one of {known}, from {self.embedded} or "
            f"{' or '.join(map(str, self._added))}; "
            "add one by: vla-deploy models add"
        )

    def draft(self, name: str) -> Path:
        """Return an empty folder to prepare a model in; `install` brings it to its place.

        Raises:
            ModelUnknown: the name cannot be used, or comes with the software.
            OSError: the folder cannot be made.
        """
        if not is_name(name):
            raise ModelUnknown(
                f"a model cannot be called {name!r}: expected small letters, digits, '_', '-', '.'"
            )
        if name in _names(self.embedded):
            raise ModelUnknown(f"{name!r} comes with the software; choose another name")
        folder = self.user / f".{name}-{os.getpid()}" / name
        shutil.rmtree(folder.parent, ignore_errors=True)
        folder.mkdir(parents=True)
        return folder

    def install(self, draft: Path) -> Path:
        """Put a prepared folder into its place; what was there before is replaced.

        Raises:
            OSError: the folder cannot be moved.
        """
        place = self.user / draft.name
        if place.exists():
            place.rename(draft.parent / "replaced")
        draft.rename(place)
        self.abandon(draft)
        return place

    def abandon(self, draft: Path) -> None:
        """Remove what was prepared and not installed."""
        shutil.rmtree(draft.parent, ignore_errors=True)

    def remove(self, name: str) -> None:
        """Delete a model that a person has added.

        Raises:
            ModelUnknown: there is none of that name, or it comes with the software.
            OSError: it cannot be deleted.
        """
        if name not in _names(self.user):
            own = ", ".join(sorted(_names(self.user))) or "none"
            raise ModelUnknown(f"no model {name!r} was added; {self.user} holds: {own}")
        shutil.rmtree(self.user / name)


def _names(folder: Path) -> Iterator[str]:
    if folder.is_dir():
        for path in folder.iterdir():
            if is_name(path.name) and (path / MANIFEST).is_file():
                yield path.name
