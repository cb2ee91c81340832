"""Keep a person's model only once it has been tried out."""

import shutil
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Final, TypeVar

from vla_deploy.inference.errors import ModelUnknown
from vla_deploy.inference.manifest import Embedding, Language, Manifest, ModelFile, Whisper
from vla_deploy.inference.manifest_file import read_manifest, write_manifest
from vla_deploy.inference.store import ModelStore, StoredModel, sha256_of

CARD: Final = "card.md"
T = TypeVar("T")


@dataclass(frozen=True, slots=True, kw_only=True)
class FolderSource:
    """Hold what a person says of a model that is a folder of files."""

    name: str
    folder: Path
    summary: str
    licence: str
    card: Path | None = None

    def manifest(
        self,
        role: str,
        parts: Iterable[str],
        *,
        whisper: Whisper | None = None,
        language: Language | None = None,
        embedding: Embedding | None = None,
    ) -> Manifest:
        """Return the manifest of a model that these files of the folder make up.

        Raises:
            ModelFileSpoiled: one cannot be read.
        """
        return Manifest(
            name=self.name,
            role=role,
            summary=self.summary,
            licence=self.licence,
            card=CARD if self.card else "",
            parts=tuple(
                ModelFile(path=name, sha256=sha256_of(self.folder / name)) for name in parts
            ),
            whisper=whisper,
            language=language,
            embedding=embedding,
        )


def require_free(store: ModelStore, name: str, *, replace: bool) -> None:
    """Accept that a model gets a name.

    Raises:
        ModelUnknown: there is one of that name, and it is not to be replaced.
    """
    if name in store.names() and not replace:
        raise ModelUnknown(f"there is a model {name!r} already; give --replace, or a name")


def keep_folder(
    store: ModelStore, source: FolderSource, manifest: Manifest, try_out: Callable[[StoredModel], T]
) -> tuple[StoredModel, T]:
    """Keep a model that is a folder of files, as `keep_tried` does."""
    files = {part.path: source.folder / part.path for part in manifest.parts}
    return keep_tried(store, manifest, files, source.card, try_out)


def keep_tried(
    store: ModelStore,
    manifest: Manifest,
    files: Mapping[str, Path],
    card: Path | None,
    try_out: Callable[[StoredModel], T],
) -> tuple[StoredModel, T]:
    """Copy a model's files and its card under their names, try it out there, and install it.

    Returns the model and what the trial gave; when anything is wrong, nothing has changed.

    Raises:
        ModelUnknown: the name cannot be used.
        ManifestInvalid: what the person gave makes no manifest that can be read.
        OSError: the model cannot be stored.
        InferenceError: it does not run, as `try_out` says.
    """
    draft = store.draft(manifest.name)
    try:
        for name, source in files.items():
            shutil.copyfile(source, draft / name)
        if card is not None:
            shutil.copyfile(card, draft / CARD)
        write_manifest(draft, manifest)
        read_manifest(draft)
        trial = try_out(StoredModel(manifest=manifest, folder=draft))
        folder = store.install(draft)
    finally:
        store.abandon(draft)
    return StoredModel(manifest=manifest, folder=folder), trial
