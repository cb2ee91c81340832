"""Record what a command does to a folder, and lay out what a power cut may leave of that.

The rules are those of POSIX, not of one file system: a name is on the disk once its folder was
synced, a content and its mode once their file was. Until then a folder may hold its names of any
moment since, each folder another moment; a file any content since, half of it, or none. A rename is
never seen half done.
"""

import os
import random
import stat
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

ROOT_NODE: Final = 0
_CHANGING: Final = frozenset(
    {"os.rename", "os.remove", "os.mkdir", "os.rmdir", "os.symlink", "os.link", "os.chmod"}
)
_WRITING: Final = os.O_WRONLY | os.O_RDWR | os.O_CREAT | os.O_TRUNC


@dataclass(frozen=True, slots=True)
class FileNode:
    """Hold a file at one moment."""

    mode: int
    content: bytes


@dataclass(frozen=True, slots=True)
class LinkNode:
    """Hold a symbolic link, which never changes."""

    target: str


@dataclass(frozen=True, slots=True)
class FolderNode:
    """Hold the names in a folder at one moment, each with the number of its node."""

    mode: int
    names: tuple[tuple[str, int], ...]


DiskNode = FileNode | LinkNode | FolderNode
Moment = Mapping[int, DiskNode]


StateChoice = Callable[[Sequence[DiskNode]], DiskNode]
"""Choose one of the states that a power cut may leave of a node; they come the surest first."""


def as_killed(states: Sequence[DiskNode]) -> DiskNode:
    """Choose what there was: the program died, the computer did not."""
    return states[-1]


def as_lost(states: Sequence[DiskNode]) -> DiskNode:
    """Choose what is sure to be on the disk."""
    return states[0]


def as_emptied(states: Sequence[DiskNode]) -> DiskNode:
    """Choose the newest names, and the contents that are sure to be on the disk."""
    return states[0] if isinstance(states[0], FileNode) else states[-1]


def as_drawn(draw: random.Random) -> StateChoice:
    """Return what chooses at random."""
    return lambda states: draw.choice(states)


@dataclass(slots=True)
class DiskHistory:
    """Hold a folder before each operation and after the last one, and what was synced when.

    `syncs` are the numbers of nodes by the number of the operation, None for all of them.
    """

    operations: list[str] = field(default_factory=list)
    moments: list[Moment] = field(default_factory=list)
    syncs: dict[int, int | None] = field(default_factory=dict)

    def last_with(self, name: str) -> int:
        """Return the last operation before which the folder itself held a name, -1 for none."""
        roots = (moment[ROOT_NODE] for moment in self.moments)
        held = [isinstance(one, FolderNode) and name in dict(one.names) for one in roots]
        return max((at for at, holds in enumerate(held) if holds), default=-1)

    def lay_out(self, cut: int, choose: StateChoice, folder: Path) -> None:
        """Write what a cut before the operation `cut` leaves, as `choose` has it."""
        self._write(ROOT_NODE, cut, choose, folder)

    def _write(self, node: int, cut: int, choose: StateChoice, path: Path) -> None:
        state = choose(self._states(node, cut))
        match state:
            case LinkNode():
                path.symlink_to(state.target)
            case FileNode():
                path.write_bytes(state.content)
                path.chmod(state.mode)
            case FolderNode():
                path.mkdir(parents=node == ROOT_NODE)
                for name, child in state.names:
                    self._write(child, cut, choose, path / name)
                path.chmod(state.mode)

    def _states(self, node: int, cut: int) -> list[DiskNode]:
        """Return what may be left of a node, the surest first, the newest last."""
        synced = [at for at, which in self.syncs.items() if at < cut and which in (node, None)]
        seen = [at for at in range(cut + 1) if node in self.moments[at]]
        since = max([at for at in synced if at in seen], default=0)
        states = [self.moments[at][node] for at in seen if at >= since]
        newest = states[-1]
        if since == 0 and node not in self.moments[0]:
            states = [_unwritten(states[0]), *states]
        if isinstance(newest, FileNode) and states[0] != newest:
            half = FileNode(newest.mode, newest.content[: len(newest.content) // 2])
            states = [*states[:-1], half, newest]
        return [*dict.fromkeys(states[:-1]), newest]


def _unwritten(state: DiskNode) -> DiskNode:
    match state:
        case FileNode(mode=mode):
            return FileNode(mode, b"")
        case FolderNode(mode=mode):
            return FolderNode(mode, ())
    return state


class _Recorder:
    """Look at a folder before each operation on it."""

    def __init__(self, folder: Path) -> None:
        self.history = DiskHistory()
        self._folder = str(folder)
        self._numbers: dict[int, int] = {}  # of the inodes that there were at the last look
        self._next = ROOT_NODE
        self._read: dict[int, tuple[tuple[int, ...], FileNode]] = {}
        self._is_looking = False

    def note(self, event: str, arguments: tuple[Any, ...]) -> None:
        """Look at the folder where an operation may change it."""
        if self._is_looking:
            return
        if event == "open":
            path, _, flags = arguments
            if not isinstance(flags, int) or not flags & _WRITING or isinstance(path, int):
                return
        elif event not in _CHANGING:
            return
        path = f"fd {arguments[0]}" if isinstance(arguments[0], int) else os.fsdecode(arguments[0])
        if not path.startswith("/") or path.startswith(self._folder):
            self.look(f"{event} {path}")

    def synced(self, fd: int) -> None:
        """Note that a file or a folder is on the disk."""
        self.look("fsync")
        number = self._numbers.get(os.fstat(fd).st_ino)
        if number is not None:
            self.history.syncs[len(self.history.moments) - 1] = number

    def all_synced(self) -> None:
        """Note that everything is on the disk."""
        self.look("sync")
        self.history.syncs[len(self.history.moments) - 1] = None

    def look(self, operation: str) -> None:
        """Add a moment."""
        self._is_looking = True
        numbers: dict[int, int] = {}
        nodes: dict[int, DiskNode] = {}
        self._visit(self._folder, numbers, nodes)
        self._numbers = numbers
        self.history.moments.append(nodes)
        self.history.operations.append(operation)
        self._is_looking = False

    def _visit(self, path: str, numbers: dict[int, int], nodes: dict[int, DiskNode]) -> int:
        found = os.lstat(path)
        number = numbers.get(found.st_ino, self._numbers.get(found.st_ino))
        if number is None:
            number, self._next = self._next, self._next + 1
        numbers[found.st_ino] = number
        mode = stat.S_IMODE(found.st_mode)
        if stat.S_ISDIR(found.st_mode):
            names = sorted(os.listdir(path))  # noqa: PTH208 - a Path for each name takes as long as all else
            children = [(name, self._visit(f"{path}/{name}", numbers, nodes)) for name in names]
            nodes[number] = FolderNode(mode, tuple(children))
        elif stat.S_ISLNK(found.st_mode):
            nodes[number] = LinkNode(os.readlink(path))  # noqa: PTH115
        else:
            nodes[number] = self._file(number, path, mode, found)
        return number

    def _file(self, number: int, path: str, mode: int, found: os.stat_result) -> FileNode:
        key = (found.st_mtime_ns, found.st_ctime_ns, found.st_size)
        if number not in self._read or self._read[number][0] != key:
            self._read[number] = (key, FileNode(mode, Path(path).read_bytes()))
        return self._read[number][1]


_active: list[_Recorder] = []
_hooks: list[Callable[[str, tuple[Any, ...]], None]] = []


def _hook(event: str, arguments: tuple[Any, ...]) -> None:
    if _active:
        _active[-1].note(event, arguments)


@contextmanager
def recorded(folder: Path) -> Iterator[DiskHistory]:
    """Record what this process does to a folder; nothing is really synced meanwhile.

    What its children do is seen at the next operation of its own, and is not synced.
    """
    if not _hooks:
        _hooks.append(_hook)
        sys.addaudithook(_hook)  # for good: Python has no way to take one away
    recorder = _Recorder(folder)
    _active.append(recorder)
    try:
        with synced_by(recorder.synced, recorder.all_synced):
            yield recorder.history
        recorder.look("end")
    finally:
        _active.pop()


@contextmanager
def synced_by(fsync: Callable[[int], None], sync: Callable[[], None]) -> Iterator[None]:
    """Call these instead of waiting for the disk."""
    real = os.fsync, os.sync
    os.fsync, os.sync = fsync, sync  # type: ignore[assignment]
    try:
        yield
    finally:
        os.fsync, os.sync = real
