"""Change files and links so that a power cut leaves the old or the new, never half of one."""

import os
from collections.abc import Iterable
from pathlib import Path

from vla_deploy.install.changes import ChangeKind, FileChange
from vla_deploy.install.layout import InstallLayout

_WRITTEN = (ChangeKind.WRITE, ChangeKind.UPDATE, ChangeKind.BESIDE)


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


def write_file(path: Path, text: str, mode: int) -> None:
    """Write a whole file under its name, or leave what was there."""
    path.parent.mkdir(parents=True, exist_ok=True)
    fresh = path.with_name(f".{path.name}.fresh")
    with fresh.open("w") as file:
        file.write(text)
        file.flush()
        os.fsync(file.fileno())
    fresh.chmod(mode)
    fresh.replace(path)
    sync_folder(path.parent)


def point(link: Path, target: str) -> None:
    """Let a symbolic link point elsewhere in one step."""
    fresh = link.with_name(f".{link.name}.fresh")
    fresh.unlink(missing_ok=True)
    fresh.symlink_to(target)
    fresh.replace(link)
    sync_folder(link.parent)


def sync_folder(folder: Path) -> None:
    """Make sure that a rename in `folder` survives a power cut."""
    fd = os.open(folder, os.O_RDONLY | os.O_DIRECTORY)
    try:
        os.fsync(fd)
    finally:
        os.close(fd)


def remove_if_empty(folder: Path) -> None:
    """Remove a folder that nothing is left in."""
    if folder.is_dir() and not any(folder.iterdir()):
        folder.rmdir()


def _remove_empty_parents(folder: Path, prefix: Path) -> None:
    """Remove folders of our own that nothing is left in; those of the system stay."""
    while folder.is_relative_to(prefix) and not any(folder.iterdir()):
        folder.rmdir()
        folder = folder.parent
