"""Decide what has to change on disk, change it, and keep the manifest of what was written.

What a person has edited is never overwritten, and exactly what was written is removed again.
"""

import hashlib
import json
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from enum import StrEnum
from pathlib import Path
from typing import Any

from vla_deploy.install.disk import write_file
from vla_deploy.install.errors import InstallError
from vla_deploy.install.files import InstalledFile, ServiceChoice
from vla_deploy.install.layout import InstallLayout

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


_WRITTEN = (ChangeKind.WRITE, ChangeKind.UPDATE, ChangeKind.BESIDE)

Known = Mapping[Path, frozenset[str]]  # digests of what we have written, by path
OnDisk = Mapping[Path, str | None]


def digest(text: str) -> str:
    """Return the digest of a content."""
    return hashlib.sha256(text.encode()).hexdigest()


def paths_of(wanted: Iterable[InstalledFile], known: Known) -> tuple[Path, ...]:
    """Return every path that a decision must know the content of."""
    paths = [file.path for file in wanted]
    return tuple(dict.fromkeys([*paths, *(new_version_path(path) for path in paths), *known]))


def new_version_path(path: Path) -> Path:
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
    """Return what removes everything that we wrote and that is not edited since."""
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
    path = new_version_path(edited.path)
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


def read_files(layout: InstallLayout, paths: Iterable[Path]) -> dict[Path, str | None]:
    """Return the content of each file; None for one that is not there."""
    found = {}
    for path in paths:
        file = layout.on_disk(path)
        found[path] = file.read_text(errors="replace") if file.is_file() else None
    return found


def apply_changes(layout: InstallLayout, changes: Iterable[FileChange]) -> None:
    """Write and remove what was decided."""
    for change in changes:
        file = layout.on_disk(change.path)
        if change.kind in _WRITTEN and change.after is not None:
            write_file(file, change.after, change.mode)
        elif change.kind is ChangeKind.REMOVE:
            file.unlink()
            _remove_empty_parents(file.parent, layout.on_disk(layout.prefix))


def _remove_empty_parents(folder: Path, prefix: Path) -> None:
    """Remove empty folders below the prefix; those of the system stay."""
    while folder.is_relative_to(prefix) and not any(folder.iterdir()):
        folder.rmdir()
        folder = folder.parent


def read_manifest(layout: InstallLayout) -> dict[Path, frozenset[str]]:
    """Return the digests of what was written, by path; nothing when nothing is installed.

    Raises:
        InstallError: the manifest is damaged.
    """
    listed = _document(layout).get("files", {})
    return {Path(path): frozenset(digests) for path, digests in listed.items()}


def installed_choice(layout: InstallLayout) -> ServiceChoice:
    """Return what the installed service runs; what it would run when nothing is installed.

    Raises:
        InstallError: the manifest is damaged.
    """
    service = _document(layout).get("service", {})
    return ServiceChoice(robot=service.get("robot", "butler"), profile=service.get("profile", ""))


def write_manifest(
    layout: InstallLayout,
    known: Mapping[Path, Iterable[str]],
    choice: ServiceChoice | None = None,
) -> None:
    """Write the manifest, or remove it when nothing is left to remember."""
    file = layout.on_disk(layout.manifest)
    if not known:
        file.unlink(missing_ok=True)
        return
    listed = {str(path): sorted(digests) for path, digests in known.items()}
    service = {"robot": choice.robot, "profile": choice.profile} if choice else {}
    text = json.dumps({"files": listed, "service": service}, indent=1)
    write_file(file, f"{text}\n", 0o644)


def _document(layout: InstallLayout) -> dict[str, Any]:
    file = layout.on_disk(layout.manifest)
    if not file.is_file():
        return {}
    try:
        document = json.loads(file.read_text())
    except json.JSONDecodeError as error:
        raise _damaged(file, str(error)) from error
    tables = ("files", "service")
    if not isinstance(document, dict) or not all(
        isinstance(document.get(name), dict) for name in tables
    ):
        raise _damaged(file, f"expected the tables {' and '.join(tables)}")
    return document


def _damaged(file: Path, what: str) -> InstallError:
    return InstallError(
        f"manifest {file} is damaged ({what}); move it away and install again: files that "
        "are there already will be kept, with the new version beside them"
    )


def during(known: Known, changes: Iterable[FileChange]) -> dict[Path, frozenset[str]]:
    """Return what is ours while the changes go on: the old versions and the new ones."""
    return {
        path: known.get(path, frozenset()) | digests
        for path, digests in {**dict(known), **afterwards(known, changes)}.items()
    }


def afterwards(known: Known, changes: Iterable[FileChange]) -> dict[Path, frozenset[str]]:
    """Return what is ours once every change is made; a kept file that was edited still is."""
    ours = {
        change.path: frozenset({digest(change.after)})
        for change in changes
        if change.kind in (ChangeKind.SAME, *_WRITTEN) and change.after is not None
    }
    edited = {
        change.path: known[change.path]
        for change in changes
        if change.kind is ChangeKind.KEEP and change.path in known
    }
    return {**edited, **ours}
