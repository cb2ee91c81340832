"""Find and remove what Fast DDS leaves in /dev/shm when a process is killed.

A segment is `fastrtps_<16 hex digits>`, a port `fastrtps_port<number>`. The owner of one holds a
lock (flock) on a file next to it: `<name>_el` where it is the only one, `<name>_sl` where it shares
the port. The kernel releases the lock when the process ends, however it ends. So a lock file that
is not locked belongs to a dead process: `fastdds shm clean` goes by the same rule.

Other ROS programs on this computer keep what is theirs. Ports without any lock file stay: a living
process may still write to one, and Fast DDS uses them again.
"""

import contextlib
import fcntl
import re
from collections.abc import Iterator
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Final

SHARED_MEMORY: Final = Path("/dev/shm")
YOUNG_S: Final = 10.0
"""A process that starts creates its lock file a moment before it locks it."""
_LOCK_FILE: Final = re.compile(r"(fastrtps_(?:[0-9a-f]{16}|port\d{1,5}))_[es]l")


@dataclass(frozen=True, slots=True, kw_only=True)
class FastDdsLeftover:
    """Hold the files of one segment or port whose owner is dead."""

    name: str
    locks: tuple[Path, ...]
    contents: tuple[Path, ...]

    @property
    def size_bytes(self) -> int:
        """Return the shared memory that it takes."""
        size = 0
        for file in self.contents:
            with contextlib.suppress(FileNotFoundError):
                size += file.stat().st_size
        return size


def find_leftovers(
    folder: Path = SHARED_MEMORY, young_s: float = YOUNG_S
) -> tuple[FastDdsLeftover, ...]:
    """Return what dead processes have left in a folder, unless a lock is younger than `young_s`."""
    found = (_leftover(folder, name, locks) for name, locks in _locks_by_name(folder).items())
    return tuple(one for one in found if _is_dead(one.locks, young_s))


def remove_leftovers(
    folder: Path = SHARED_MEMORY, young_s: float = YOUNG_S
) -> tuple[FastDdsLeftover, ...]:
    """Remove what dead processes have left, and return it; what belongs to other users stays.

    Their locks are held meanwhile, so nobody takes a port over that is about to go.
    """
    removed: list[FastDdsLeftover] = []
    for leftover in find_leftovers(folder, young_s):
        with _hold(leftover.locks) as is_held:
            if is_held and _unlink(leftover):
                removed.append(leftover)
    return tuple(removed)


def _locks_by_name(folder: Path) -> dict[str, tuple[Path, ...]]:
    locks: dict[str, tuple[Path, ...]] = {}
    if folder.is_dir():
        for file in sorted(folder.iterdir()):
            if matched := _LOCK_FILE.fullmatch(file.name):
                locks[matched.group(1)] = (*locks.get(matched.group(1), ()), file)
    return locks


def _leftover(folder: Path, name: str, locks: tuple[Path, ...]) -> FastDdsLeftover:
    mutex = folder / f"sem.{name}_mutex"
    contents = tuple(file for file in (folder / name, mutex) if file.exists())
    return FastDdsLeftover(name=name, locks=locks, contents=contents)


def _is_dead(locks: tuple[Path, ...], young_s: float) -> bool:
    """Return whether nobody holds any of the locks; one that cannot be examined counts as held."""
    now_s = datetime.now(UTC).timestamp()  # as the files' times are the wall clock's, too
    try:
        if any(abs(now_s - lock.stat().st_mtime) < young_s for lock in locks):
            return False
    except OSError:
        return False
    with _hold(locks) as is_held:
        return is_held


@contextlib.contextmanager
def _hold(locks: tuple[Path, ...]) -> Iterator[bool]:
    """Hold all locks, and give whether that was possible; none are waited for."""
    with contextlib.ExitStack() as stack:
        try:
            for lock in locks:
                file = stack.enter_context(lock.open("rb"))
                fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:  # somebody holds it, or it is gone, or not ours to open
            yield False
            return
        yield True


def _unlink(leftover: FastDdsLeftover) -> bool:
    """Remove the files, locks last; return False where another user owns them."""
    try:
        for file in (*leftover.contents, *leftover.locks):
            file.unlink(missing_ok=True)
    except PermissionError:
        return False
    return True
