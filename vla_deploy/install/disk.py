"""Write files and links so that a power cut leaves the old or the new, never half of one."""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Final

_FOR_ALL_TO_READ: Final = 0o022


@contextmanager
def readable_by_all() -> Iterator[None]:
    """Let all users enter the folders made meanwhile: root's own mask may keep the service out."""
    own = os.umask(_FOR_ALL_TO_READ)
    try:
        yield
    finally:
        os.umask(own)


def write_file(path: Path, text: str, mode: int) -> None:
    """Write a whole file under its name, or leave what was there."""
    path.parent.mkdir(parents=True, exist_ok=True)
    fresh = path.with_name(f".{path.name}.fresh")
    with fresh.open("w") as file:
        file.write(text)
        file.flush()
        os.fchmod(file.fileno(), mode)
        os.fsync(file.fileno())
    fresh.replace(path)
    sync_folder(path.parent)


def point(link: Path, target: str) -> None:
    """Point a symbolic link elsewhere in one step."""
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
    """Remove an empty folder."""
    if folder.is_dir() and not any(folder.iterdir()):
        folder.rmdir()
