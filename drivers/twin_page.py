"""Lay out what the twin's time is told by: a page of shared memory, and packets on a socket.

The twin alone writes the time into the page, and everybody reads it there. A thread that waits, or
declares how far time may go on without it, sends a packet to the twin over a connection of its own
(Unix SOCK_SEQPACKET beside the page), which answers a wait by one byte. The end of either side is
an end of file for the other.
"""

import json
import mmap
import os
import struct
import time
from dataclasses import dataclass
from enum import IntEnum, StrEnum
from pathlib import Path
from typing import Final

PAGE_FILE: Final = "time_page"
TIME_SOCKET: Final = "time"
"""Both lie among the twin's devices."""
TIME_LINK: Final = "time"
"""In the run's directory: leads to the devices whose time the run lives by, none to the wall's."""
PAGE_BYTES: Final = 4096
GRANT: Final = b"\x01"
MAX_PACKET_BYTES: Final = 512
_HEAD: Final = struct.Struct("<Bqq")


class TwinPace(StrEnum):
    """Name how the twin's time goes."""

    REAL = "real"  # waits for its members, and is never faster than the wall clock
    FAST = "fast"  # waits for its members, else as fast as this computer can
    WALL = "wall"  # is the wall clock, whoever is late


class PageWord(IntEnum):
    """Name the 64-bit words of the page."""

    NOW_NS = 0  # simulated time, continuous with CLOCK_MONOTONIC at the twin's start
    OFFSET_NS = 1  # of NOW_NS to CLOCK_MONOTONIC when the twin last went round
    GOVERNOR_PID = 2  # the twin that moves time; 0: nobody, time goes on by the wall clock
    GENERATION = 3  # counts the times at which a twin took time over
    ABANDONED = 4  # the generation that members found dead or stopped; theirs is the only write
    WRITES = 5  # counts the moments at which a device may have got something to read


class Op(IntEnum):
    """Name what a packet asks of the twin; `a` and `b` are its two numbers."""

    WAIT = 0  # until a; then hold time at b
    WAIT_IO = 1  # the same, or until a device has written since the page's WRITES were b
    HOLD = 2  # at a, without waiting
    RELEASE = 3  # hold time no more
    JOIN = 4  # as the member that the role names; a: pid
    EXPECT = 5  # a child with pid a, whose loading takes b of simulated time


DEFAULT_HOLD: Final = -1
"""In place of `b`: the member's slack after the moment at which its wait ended."""
UNTIL_LOADED: Final = -1
"""In place of `a` of a WAIT: until the time that was declared for loading is over."""


@dataclass(frozen=True, slots=True, kw_only=True)
class TimeRole:
    """Say how a member takes part in time.

    Members that are due at once are woken in the order of `order`. Time passes the moment at which
    a member was woken by at most `slack_ns` while it works; None lets it pass freely. One that
    works for longer than `patience_s` of wall time is taken for hung and holds time no more.
    """

    name: str
    order: int
    slack_ns: int | None = 0
    patience_s: float = 10.0


def pack(op: Op, a: int = 0, b: int = 0, role: TimeRole | None = None) -> bytes:
    """Return one packet."""
    head = _HEAD.pack(op, a, b)
    if role is None:
        return head
    return head + json.dumps([role.name, role.order, role.slack_ns, role.patience_s]).encode()


def unpack(packet: bytes) -> tuple[Op, int, int, TimeRole | None]:
    """Return what a packet says.

    Raises:
        ValueError: it is none.
    """
    if len(packet) < _HEAD.size:
        raise ValueError(f"time packet: expected at least {_HEAD.size} bytes, got {len(packet)}")
    number, a, b = _HEAD.unpack_from(packet)
    if len(packet) == _HEAD.size:
        return Op(number), a, b, None
    name, order, slack_ns, patience_s = json.loads(packet[_HEAD.size :])
    return (
        Op(number),
        a,
        b,
        TimeRole(name=name, order=order, slack_ns=slack_ns, patience_s=patience_s),
    )


class TimePage:
    """Map the page of one run."""

    def __init__(self, path: Path) -> None:
        """Map a page that was made.

        Raises:
            FileNotFoundError: there is none.
        """
        fd = os.open(path, os.O_RDWR | os.O_CLOEXEC)
        try:
            self._memory = mmap.mmap(fd, PAGE_BYTES)
        finally:
            os.close(fd)
        self.words = memoryview(self._memory).cast("q")

    @staticmethod
    def create(path: Path) -> "TimePage":
        """Map a page; where there is none yet, time is the wall clock's until a twin takes over."""
        if path.exists():
            return TimePage(path)
        unfinished = path.with_name(f".{path.name}")
        unfinished.write_bytes(bytes(PAGE_BYTES))
        unfinished.rename(path)
        return TimePage(path)

    @property
    def is_governed(self) -> bool:
        """Return whether a twin moves time, as far as its members know."""
        words = self.words
        return (
            words[PageWord.GOVERNOR_PID] != 0
            and words[PageWord.ABANDONED] != words[PageWord.GENERATION]
        )

    def now_ns(self) -> int:
        """Return the twin's time; by the wall clock from its last value where no twin moves it."""
        words = self.words
        # Plain numbers: this is read some fifty times in each tick of control.
        if words[2] and words[4] != words[3]:
            return words[0]
        return max(words[0], words[1] + time.monotonic_ns())

    def silent_ns(self) -> int:
        """Return for how long the twin has not gone round."""
        return self.words[PageWord.OFFSET_NS] + time.monotonic_ns() - self.words[PageWord.NOW_NS]

    def abandon(self, generation: int) -> None:
        """Continue by the wall clock: the twin of that generation is no more."""
        if self.words[PageWord.GENERATION] == generation:
            self.words[PageWord.ABANDONED] = generation


DEAD: Final = frozenset("XZx")
STOPPED: Final = frozenset("Tt")
"""States of a process, as proc_pid_stat(5) names them."""


def process_state(pid: int) -> str:
    """Return the state of a process as proc_pid_stat(5) has it, "X" for one that is no more."""
    # Unbuffered and without a Path: the twin asks hundreds of times a second.
    try:
        with open(f"/proc/{pid}/stat", "rb", buffering=0) as file:  # noqa: PTH123
            return chr(file.read(512).rpartition(b") ")[2][0])
    except OSError:
        return "X"
