"""Keep files in a folder of the robot's user, also when root writes them."""

import fcntl
import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Final

MODE: Final = 0o600
_FOLDER_MODE: Final = 0o700
_SAFE: Final = os.O_NOFOLLOW | os.O_CLOEXEC


def open_private(path: Path, flags: int) -> int:
    """Open a file that only its owner may read, create it where it is missing; return its handle.

    Raises:
        OSError: it cannot be opened, or is a link.
    """
    make_folder(path.parent)
    handle = os.open(path, flags | os.O_CREAT | _SAFE, MODE)
    give(handle, path.parent)
    return handle


@contextmanager
def turn(lock: Path) -> Iterator[None]:
    """Hold a lock among processes.

    Raises:
        OSError: its file cannot be opened.
    """
    handle = open_private(lock, os.O_RDWR)
    try:
        fcntl.flock(handle, fcntl.LOCK_EX)
        yield
    finally:
        os.close(handle)


def give(handle: int, folder: Path) -> None:
    """Give a file that root writes to the folder's owner, as whom the robot reads it."""
    owner = folder.stat()
    if os.getuid() == 0 and owner.st_uid != 0:
        os.fchown(handle, owner.st_uid, owner.st_gid)


def make_folder(folder: Path) -> None:
    """Make a folder that only its owner may open, who is the owner of the folder above.

    Raises:
        OSError: it cannot be made.
    """
    if folder.is_dir():
        return
    folder.mkdir(mode=_FOLDER_MODE, parents=True, exist_ok=True)
    owner = folder.parent.stat()
    if owner.st_uid != os.getuid():
        os.chown(folder, owner.st_uid, owner.st_gid, follow_symlinks=False)
