"""Live on the twin's time: it waits for its members, and they wait for it.

Time stands still while a member works, but for the slack that it has declared; so nothing that a
robot does in the twin depends on how busy the computer is. A member that has died, is stopped, or
hangs, holds it no more. Nor does a twin that has died or is stopped hold its members: they go on by
the wall clock, from the last value.
"""

import contextlib
import select
import socket
import threading
import time
import weakref
from pathlib import Path
from typing import Final

from drivers.clock import NS_PER_S, Clock, MonotonicClock
from drivers.twin_page import (
    DEAD,
    DEFAULT_HOLD,
    MAX_PACKET_BYTES,
    PAGE_FILE,
    STOPPED,
    TIME_LINK,
    TIME_SOCKET,
    UNTIL_LOADED,
    Op,
    PageWord,
    TimePage,
    TimeRole,
    pack,
    process_state,
)

_LOOK_AFTER_TWIN_S: Final = 0.25
_HUNG_TWIN_NS: Final = 10 * NS_PER_S
_NAP_NS: Final = 50_000_000
_STEP_NS: Final = 500_000
"""How often a member looks again for input that another process than the twin may write."""


class TimeLine:
    """Hold one connection to the twin that moves time; belongs to one thread at a time."""

    def __init__(self, page: TimePage, devices_dir: Path) -> None:
        """Connect.

        Raises:
            OSError: nobody moves time there.
        """
        self._page = page
        self.generation = page.words[PageWord.GENERATION]
        self._socket = socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        try:
            self._socket.connect(str(devices_dir / TIME_SOCKET))
        except OSError:
            self._socket.close()
            raise
        self._close = weakref.finalize(self, self._socket.close)
        self._poll = select.poll()
        self._poll.register(self._socket, select.POLLIN)

    @property
    def is_current(self) -> bool:
        """Return whether the twin at the other end moves time still."""
        page = self._page
        return page.is_governed and page.words[PageWord.GENERATION] == self.generation

    def close(self) -> None:
        """Close the connection; closing twice is allowed."""
        self._close()

    def fileno(self) -> int:
        """Return the descriptor that has input once a wait is over."""
        return self._socket.fileno()

    def send(self, op: Op, a: int = 0, b: int = 0, role: TimeRole | None = None) -> None:
        """Ask the twin for something; one that has gone is found by the next wait."""
        with contextlib.suppress(BrokenPipeError, ConnectionResetError):
            self._socket.send(pack(op, a, b, role))

    def granted(self) -> None:
        """Wait until the twin ends the wait that was asked for, or moves time no more."""
        while not self._poll.poll(_LOOK_AFTER_TWIN_S * 1000.0):
            if not self.is_current:
                return
            self._look_after_twin()
        try:
            packet = self._socket.recv(MAX_PACKET_BYTES)
        except ConnectionResetError:
            packet = b""
        if not packet:
            self._page.abandon(self.generation)

    def _look_after_twin(self) -> None:
        is_gone = process_state(self._page.words[PageWord.GOVERNOR_PID]) in DEAD | STOPPED
        if is_gone or self._page.silent_ns() > _HUNG_TWIN_NS:
            self._page.abandon(self.generation)


class TwinClock:
    """Read the twin's time and wait in it, from any thread of any process of the run.

    A thread that has not joined watches: its waits hold nothing.
    """

    def __init__(self, devices_dir: Path) -> None:
        """Map the twin's page.

        Raises:
            FileNotFoundError: there is none.
        """
        self.page = page = TimePage(devices_dir / PAGE_FILE)
        self._devices_dir = devices_dir
        self._local = threading.local()
        self.now_ns = page.now_ns
        """Return the twin's time in nanoseconds; no call in between, as it is asked often."""

    def join(self, role: TimeRole, pid: int) -> None:
        """Take part in time on this thread; return when the time declared for loading is over.

        Time stands still from then on until this thread waits, or releases it.
        """
        self._local.joined = role, pid
        self._local.line = None
        line = self._line()
        if line is not None:
            line.send(Op.WAIT, UNTIL_LOADED, DEFAULT_HOLD)
            line.granted()

    def expect(self, pid: int, role: TimeRole, loading_ns: int) -> None:
        """Announce a child: time waits for it where its loading takes longer."""
        line = self._line()
        if line is not None:
            line.send(Op.EXPECT, pid, loading_ns, role)

    def hold_until(self, until_ns: int) -> None:
        """Hold time at a moment to come while this thread works, until it waits next."""
        line = self._line()
        if line is not None:
            line.send(Op.HOLD, until_ns)

    def release(self) -> None:
        """Hold time no more until this thread waits next."""
        line = self._line()
        if line is not None:
            line.send(Op.RELEASE)

    def sleep_until(self, deadline_ns: int) -> None:
        """Return at `deadline_ns` or at once when it has passed."""
        while self.now_ns() < deadline_ns:
            self._wait(Op.WAIT, deadline_ns, DEFAULT_HOLD)

    def sleep_until_governed(self, deadline_ns: int) -> None:
        """Return at `deadline_ns`, or as soon as a twin takes time over.

        What a member does from then on depends on the twin's time alone, not on the wall's.
        """
        was_governed = self.page.is_governed
        while self.now_ns() < deadline_ns:
            self._wait(Op.WAIT, deadline_ns, DEFAULT_HOLD)
            if not was_governed and self._line() is not None:
                return

    def wait_readable(self, poll: select.poll, deadline_ns: int) -> bool:
        """Return True as soon as `poll` has input, False at `deadline_ns`."""
        while True:
            writes = self.page.words[PageWord.WRITES]
            if poll.poll(0):
                return True
            now_ns = self.now_ns()
            if now_ns >= deadline_ns:
                return False
            self._wait(Op.WAIT_IO, min(deadline_ns, now_ns + _STEP_NS), writes)

    def line(self) -> TimeLine | None:
        """Return a connection for a thread to come, None where no twin moves time."""
        generation = self.page.words[PageWord.GENERATION]
        if not self.page.is_governed:
            return None
        try:
            return TimeLine(self.page, self._devices_dir)
        except (ConnectionRefusedError, FileNotFoundError):
            self.page.abandon(generation)  # it listens before it takes over: it has died
            return None

    def _wait(self, op: Op, until_ns: int, b: int) -> None:
        line = self._line()
        if line is not None:
            line.send(op, until_ns, b)
            line.granted()
        else:
            time.sleep(max(0, min(until_ns - self.now_ns(), _NAP_NS)) / NS_PER_S)

    def _line(self) -> TimeLine | None:
        """Return this thread's connection to the twin that moves time now, None without one."""
        line: TimeLine | None = getattr(self._local, "line", None)
        if line is not None and line.is_current:
            return line
        if line is not None:
            line.close()
        self._local.line = line = self.line()
        joined = getattr(self._local, "joined", None)
        if line is not None and joined is not None:
            role, pid = joined
            line.send(Op.JOIN, pid, role=role)
        return line


def clock_of(run_dir: Path) -> Clock:
    """Return the clock of a run: the twin's, where it has one, else CLOCK_MONOTONIC."""
    try:
        return TwinClock(run_dir / TIME_LINK)
    except FileNotFoundError:
        return MonotonicClock()
