"""Decide, purely, what has to change on disk; what a person has edited is never overwritten."""

import hashlib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from enum import StrEnum
from pathlib import Path

from vla_deploy.install.files import SystemFile

NEW_SUFFIX = ".vla-new"


class Kind(StrEnum):
    """Name what happens to one file."""

    SAME = "same"
    WRITE = "write"
    UPDATE = "update"
    BESIDE = "write beside the edited one"
    REMOVE = "remove"
    KEEP = "keep, as it is edited"
    FORGET = "already gone"


@dataclass(frozen=True, slots=True, kw_only=True)
class Change:
    """Say what happens to one file; `before` is None when there is none, `after` likewise."""

    kind: Kind
    path: Path
    before: str | None = None
    after: str | None = None
    mode: int = 0o644


Known = Mapping[Path, frozenset[str]]  # digests of what we have written, by path
OnDisk = Mapping[Path, str | None]


def digest(text: str) -> str:
    """Return what tells one content from another."""
    return hashlib.sha256(text.encode()).hexdigest()


def paths_of(wanted: Iterable[SystemFile], known: Known) -> tuple[Path, ...]:
    """Return every path that a decision must know the content of."""
    paths = [file.path for file in wanted]
    return tuple(dict.fromkeys([*paths, *(beside(path) for path in paths), *known]))


def beside(path: Path) -> Path:
    """Return where the new version of an edited file goes."""
    return path.with_name(path.name + NEW_SUFFIX)


def install_changes(
    wanted: Iterable[SystemFile], known: Known, on_disk: OnDisk
) -> tuple[Change, ...]:
    """Return what makes the disk hold `wanted`, and nothing that an earlier version left."""
    placed = [_placed(file, known, on_disk) for file in wanted]
    changes = placed + [_beside(change, on_disk) for change in placed if change.kind is Kind.KEEP]
    paths = {change.path for change in changes}
    stale = {path: digests for path, digests in known.items() if path not in paths}
    return (*changes, *uninstall_changes(stale, on_disk))


def uninstall_changes(known: Known, on_disk: OnDisk) -> tuple[Change, ...]:
    """Return what removes everything that we wrote and nobody has edited since."""
    return tuple(
        Change(kind=_leaving(on_disk.get(path), digests), path=path, before=on_disk.get(path))
        for path, digests in known.items()
    )


def _placed(file: SystemFile, known: Known, on_disk: OnDisk) -> Change:
    before = on_disk.get(file.path)
    return Change(
        kind=_arriving(before, file.text, known.get(file.path, frozenset())),
        path=file.path,
        before=before,
        after=file.text,
        mode=file.mode,
    )


def _beside(edited: Change, on_disk: OnDisk) -> Change:
    path = beside(edited.path)
    kind = Kind.SAME if on_disk.get(path) == edited.after else Kind.BESIDE
    return replace(edited, kind=kind, path=path)


def _arriving(before: str | None, after: str, digests: frozenset[str]) -> Kind:
    if before is None:
        return Kind.WRITE
    if before == after:
        return Kind.SAME
    return Kind.UPDATE if digest(before) in digests else Kind.KEEP


def _leaving(before: str | None, digests: frozenset[str]) -> Kind:
    if before is None:
        return Kind.FORGET
    return Kind.REMOVE if digest(before) in digests else Kind.KEEP
