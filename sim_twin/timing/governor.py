"""Move the twin's time: never past a member that is still working.

This is conservative simulation (Chandy and Misra, 1979) of real processes: whoever holds time has
said up to which moment it may go on without them. Members that hold it strictly are woken one at a
time, in the order of their due times and then of their roles; so what they do to each other does
not depend on how many cores there are, or on how busy they are.
"""

import contextlib
import logging
import os
import socket
import time
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final

from drivers.clock import NS_PER_S
from drivers.twin_page import (
    DEAD,
    DEFAULT_HOLD,
    GRANT,
    MAX_PACKET_BYTES,
    PAGE_FILE,
    STOPPED,
    TIME_SOCKET,
    UNTIL_LOADED,
    Op,
    PageWord,
    TimePage,
    TimeRole,
    process_state,
    unpack,
)
from sim_twin.timing.pacer import Pacer

_LOOK_NS: Final = 20_000_000
"""How often members that hold time are looked at: whether they are alive."""
_MOST_WAIT_S: Final = 0.02
_LOADING_PATIENCE_NS: Final = 90 * NS_PER_S
_WATCHER: Final = TimeRole(name="", order=1 << 30, slack_ns=None)
_WORKS: Final = -1
_NEVER: Final = 1 << 62
_FIRST: Final = TimeRole(name="first member", order=0)
_log = logging.getLogger(__name__)


@dataclass(slots=True, eq=False)
class TimeMember:
    """Be one connection, or a child that is expected.

    It waits until `until_ns`, or works, and then time goes no further than `hold_ns`.
    """

    role: TimeRole = _WATCHER
    connection: socket.socket | None = None
    pid: int = 0
    until_ns: int = _WORKS
    waits_for_io: bool = False
    next_hold_ns: int = DEFAULT_HOLD
    hold_ns: int = _NEVER
    since_wall_ns: int = field(default_factory=time.monotonic_ns)
    patience_ns: int = 10 * NS_PER_S
    excused: bool = False

    def holds(self) -> bool:
        """Return whether time may not pass `hold_ns`."""
        return self.until_ns == _WORKS and self.hold_ns != _NEVER and not self.excused


class Governor:
    """Own the time of one run."""

    def __init__(self, devices_dir: Path, pacer: Pacer, hold_for_pid: int | None = None) -> None:
        """Listen for members and take time over from now on.

        It stands still until the process `hold_for_pid` has joined: all that follows is then a
        matter of the twin's time.

        Raises:
            OSError: the socket cannot be made.
        """
        self.page = TimePage.create(devices_dir / PAGE_FILE)
        self._words = self.page.words
        self._pacer = pacer
        self._members: dict[int, TimeMember] = {}
        self._expected: dict[int, TimeMember] = {}
        self._path = devices_dir / TIME_SOCKET
        self._path.unlink(missing_ok=True)
        self._listener = socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        self._listener.setblocking(False)
        self._listener.bind(str(self._path))
        self._listener.listen(64)
        self._look_due_ns = 0
        self.blamed_ns: dict[str, int] = {}
        """For how long each member has held time since somebody cleared this, wall time."""
        self._blockers: list[str] = []
        self._blocked_ns = 0
        self._take_over()
        if hold_for_pid is not None:
            self._expected[hold_for_pid] = TimeMember(
                role=_FIRST, pid=hold_for_pid, hold_ns=self.now_ns
            )

    @property
    def now_ns(self) -> int:
        """Return the time, continuous with CLOCK_MONOTONIC at the start."""
        return self._words[PageWord.NOW_NS]

    def filenos(self) -> list[int]:
        """Return the descriptors whose input calls for `serve`."""
        return [self._listener.fileno(), *self._members]

    def serve(self, ready: set[int]) -> None:
        """Take what members say."""
        if self._listener.fileno() in ready:
            self._accept()
        for fileno in ready & self._members.keys():
            self._hear(fileno, self._members[fileno])

    def note_writes(self) -> None:
        """Wake members that wait for a device: it may have something for them."""
        self._words[PageWord.WRITES] += 1
        now_ns = self.now_ns
        for member in self._members.values():
            if member.waits_for_io and member.until_ns != _WORKS:
                member.until_ns = min(member.until_ns, now_ns)

    def go_round(self) -> int:
        """Show that the twin is alive, and check that its members are; return how far time leapt.

        It leaps where members had given this twin up, as one that was stopped: by now they are
        ahead, by the wall clock.
        """
        wall_ns = time.monotonic_ns()
        for name in self._blockers:
            self.blamed_ns[name] = self.blamed_ns.get(name, 0) + wall_ns - self._blocked_ns
        self._blockers = []
        leapt_ns = 0
        if not self.page.is_governed:
            before_ns = self.now_ns
            self._disconnect()
            self._take_over()
            leapt_ns = self.now_ns - before_ns
        self._words[PageWord.OFFSET_NS] = self.now_ns - wall_ns
        if wall_ns >= self._look_due_ns:
            self._look_due_ns = wall_ns + _LOOK_NS
            self._look_after(wall_ns)
        return leapt_ns

    @property
    def is_held(self) -> bool:
        """Return whether a member works that time must not pass: devices answer when it waits."""
        return self._blocks(self.now_ns)

    def go_on(self, event_ns: int) -> float | None:
        """Wake members that are due, or move time to the next event, `event_ns` at the latest.

        Return for how long to wait for members, or for the pace, before the next look; None when
        time has moved.
        """
        now_ns, waiting = self.now_ns, self._waiting()
        due = [one for one in waiting if one.until_ns <= now_ns]
        watching = [one for one in due if one.role.slack_ns is None]
        for member in watching:
            self._wake(member)
        if watching:
            return 0.0
        if due and not self.is_held:
            self._wake(min(due, key=lambda one: (one.until_ns, one.role.order)))
            return _MOST_WAIT_S
        next_ns = min((one.until_ns for one in waiting), default=event_ns)
        next_ns = max(now_ns, min(next_ns, event_ns))
        if due or self._blocks(next_ns - 1):
            self._note_blockers(max(next_ns, now_ns + 1))
            return _MOST_WAIT_S
        wait_ns = self._pacer.wait_ns(next_ns)
        if wait_ns:
            return min(wait_ns / NS_PER_S, _MOST_WAIT_S)
        self._words[PageWord.NOW_NS] = next_ns
        return None

    def close(self) -> None:
        """Give time back to the wall clock."""
        self._words[PageWord.OFFSET_NS] = self.now_ns - time.monotonic_ns()
        self._words[PageWord.GOVERNOR_PID] = 0
        self._disconnect()
        self._listener.close()
        self._path.unlink(missing_ok=True)

    def _take_over(self) -> None:
        words = self._words
        words[PageWord.NOW_NS] = words[PageWord.OFFSET_NS] + time.monotonic_ns()
        words[PageWord.GENERATION] += 1
        words[PageWord.GOVERNOR_PID] = os.getpid()
        self._pacer.start(self.now_ns)

    def _disconnect(self) -> None:
        for member in self._members.values():
            if member.connection is not None:
                member.connection.close()
        self._members.clear()
        self._expected.clear()

    def _accept(self) -> None:
        with contextlib.suppress(BlockingIOError):
            while True:
                connection, _ = self._listener.accept()
                connection.setblocking(False)
                self._members[connection.fileno()] = TimeMember(connection=connection)

    def _hear(self, fileno: int, member: TimeMember) -> None:
        assert member.connection is not None
        while True:
            try:
                packet = member.connection.recv(MAX_PACKET_BYTES)
            except BlockingIOError:
                return
            except ConnectionResetError:
                packet = b""
            if not packet:
                self._dismiss(fileno, member)
                return
            try:
                self._take(member, *unpack(packet))
            except (ValueError, TypeError) as error:
                _log.warning("closed the connection of %s: %s", member.role.name, error)
                self._dismiss(fileno, member)
                return

    def _dismiss(self, fileno: int, member: TimeMember) -> None:
        assert member.connection is not None
        member.connection.close()
        del self._members[fileno]

    def _take(self, member: TimeMember, op: Op, a: int, b: int, role: TimeRole | None) -> None:
        if op in (Op.WAIT, Op.WAIT_IO):
            self._take_wait(member, op, a, b)
        elif op is Op.HOLD:
            member.hold_ns, member.until_ns, member.excused = a, _WORKS, False
            member.since_wall_ns = time.monotonic_ns()
        elif op is Op.RELEASE:
            member.hold_ns, member.until_ns = _NEVER, _WORKS
        elif role is not None and op is Op.JOIN:
            self._join(member, a, role)
        elif role is not None and op is Op.EXPECT:
            self._expect(a, b, role)

    def _take_wait(self, member: TimeMember, op: Op, a: int, b: int) -> None:
        """Set until when a member waits: until now, where input came before this message."""
        member.excused = False
        if a == UNTIL_LOADED:  # whoever it is: its start belongs to that moment
            a = b = self.now_ns if member.hold_ns == _NEVER else member.hold_ns
        member.waits_for_io = op is Op.WAIT_IO
        missed = member.waits_for_io and b != self._words[PageWord.WRITES]
        member.until_ns = self.now_ns if missed else a
        member.next_hold_ns = DEFAULT_HOLD if member.waits_for_io else b
        member.patience_ns = round(member.role.patience_s * NS_PER_S)

    def _expect(self, pid: int, loading_ns: int, role: TimeRole) -> None:
        """Hold time for a child that loads, unless it was quicker than this message."""
        if any(one.pid == pid and one.role.name == role.name for one in self._members.values()):
            return
        self._expected[pid] = TimeMember(
            role=role,
            pid=pid,
            hold_ns=self.now_ns + loading_ns,
            patience_ns=_LOADING_PATIENCE_NS,
        )

    def _join(self, member: TimeMember, pid: int, role: TimeRole) -> None:
        member.role, member.pid = role, pid
        member.since_wall_ns = time.monotonic_ns()
        member.hold_ns = _NEVER if role.slack_ns is None else self.now_ns
        expected = self._expected.get(pid)
        if expected is not None and expected.role.name in (role.name, _FIRST.name):
            del self._expected[pid]
            member.hold_ns, member.patience_ns = expected.hold_ns, expected.patience_ns

    def _wake(self, member: TimeMember) -> None:
        assert member.connection is not None
        slack_ns = member.role.slack_ns
        if member.next_hold_ns != DEFAULT_HOLD:
            member.hold_ns = member.next_hold_ns
        else:
            member.hold_ns = _NEVER if slack_ns is None else self.now_ns + slack_ns
        member.until_ns = _WORKS
        member.since_wall_ns = time.monotonic_ns()
        with contextlib.suppress(OSError):  # it has died: its end of file comes next
            member.connection.send(GRANT)

    def _waiting(self) -> list["TimeMember"]:
        return [one for one in self._members.values() if one.until_ns != _WORKS]

    def _holders(self) -> Iterator["TimeMember"]:
        return (one for one in (*self._members.values(), *self._expected.values()) if one.holds())

    def _blocks(self, at_ns: int) -> bool:
        """Return whether a member works beyond which time would be at `at_ns`."""
        return any(one.hold_ns <= at_ns for one in self._holders())

    def _note_blockers(self, next_ns: int) -> None:
        self._blocked_ns = time.monotonic_ns()
        self._blockers = [one.role.name for one in self._holders() if one.hold_ns < next_ns]

    def _look_after(self, wall_ns: int) -> None:
        for pid, member in tuple(self._expected.items()):
            member.excused = self._is_lost(member, wall_ns)
            if process_state(pid) in DEAD:
                del self._expected[pid]
        for member in self._members.values():
            if member.pid and member.until_ns == _WORKS and member.hold_ns != _NEVER:
                member.excused = self._is_lost(member, wall_ns)

    def _is_lost(self, member: TimeMember, wall_ns: int) -> bool:
        """Return whether one that holds time is dead, stopped, or hangs."""
        state = process_state(member.pid)
        if state in DEAD or state in STOPPED:
            why = "has died" if state in DEAD else "is stopped"
            member.since_wall_ns = wall_ns
        elif wall_ns - member.since_wall_ns > member.patience_ns:
            why = f"has worked for more than {member.patience_ns / NS_PER_S:g} s"
        else:
            return False
        if not member.excused:
            _log.warning(
                "time goes on without %s (pid %d): it %s", member.role.name, member.pid, why
            )
        return True
