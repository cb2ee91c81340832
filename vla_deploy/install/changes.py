"""Decide, purely, what has to change on disk; what a person has edited is never overwritten."""

import hashlib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from enum import StrEnum
from pathlib import Path

from vla_deploy.install.files import InstalledFile

NEW_SUFFIX = ".vla-new"


class ChangeKind(StrEnum):
    """Name what happens to one file."""

    SAME = "same"
    WRITE = "write"
    UPDATE = "update"
    BESIDE = "write beside the edited one"
    REMOVE = "remove"
    KEEP = "keep, as it is edited"
    FORGET = "already gone"


@dataclass(frozen=True, slots=True, kw_only=True)
class FileChange:
    """Say what happens to one file; `before` is None when there is none, `after` likewise."""

    kind: ChangeKind
    path: Path
    before: str | None = None
    after: str | None = None
    mode: int = 0o644


Known = Mapping[Path, frozenset[str]]  # digests of what we have written, by path
OnDisk = Mapping[Path, str | None]


def digest(text: str) -> str:
    """Return what tells one content from another."""
    return hashlib.sha256(text.encode()).hexdigest()


def paths_of(wanted: Iterable[InstalledFile], known: Known) -> tuple[Path, ...]:
    """Return every path that a decision must know the content of."""
    paths = [file.path for file in wanted]
    return tuple(dict.fromkeys([*paths, *(beside(path) for path in paths), *known]))


def beside(path: Path) -> Path:
    """Return where the new version of an edited file goes."""
    return path.with_name(path.name + NEW_SUFFIX)


def install_changes(
    wanted: Iterable[InstalledFile], known: Known, on_disk: OnDisk
) -> tuple[FileChange, ...]:
    """Return what makes the disk hold `wanted`, and nothing that an earlier version left."""
    placed = [_placed(file, known, on_disk) for file in wanted]
    changes = placed + [
        _beside(change, on_disk) for change in placed if change.kind is ChangeKind.KEEP
    ]
    paths = {change.path for change in changes}
    stale = {path: digests for path, digests in known.items() if path not in paths}
    return (*changes, *uninstall_changes(stale, on_disk))


def uninstall_changes(known: Known, on_disk: OnDisk) -> tuple[FileChange, ...]:
    """Return what removes everything that we wrote and nobody has edited since."""
    return tuple(
        FileChange(kind=_leaving(on_disk.get(path), digests), path=path, before=on_disk.get(path))
        for path, digests in known.items()
    )


def _placed(file: InstalledFile, known: Known, on_disk: OnDisk) -> FileChange:
    before = on_disk.get(file.path)
    return FileChange(
        kind=_arriving(before, file.text, known.get(file.path, frozenset())),
        path=file.path,
        before=before,
        after=file.text,
        mode=file.mode,
    )


def _beside(edited: FileChange, on_disk: OnDisk) -> FileChange:
    path = beside(edited.path)
    kind = ChangeKind.SAME if on_disk.get(path) == edited.after else ChangeKind.BESIDE
    return replace(edited, kind=kind, path=path)


def _arriving(before: str | None, after: str, digests: frozenset[str]) -> ChangeKind:
    if before is None:
        return ChangeKind.WRITE
    if before == after:
        return ChangeKind.SAME
    return ChangeKind.UPDATE if digest(before) in digests else ChangeKind.KEEP


def _leaving(before: str | None, digests: frozenset[str]) -> ChangeKind:
    if before is None:
        return ChangeKind.FORGET
    return ChangeKind.REMOVE if digest(before) in digests else ChangeKind.KEEP
