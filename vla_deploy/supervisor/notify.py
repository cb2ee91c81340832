"""Tell systemd how the robot is: the notify protocol, and its watchdog fed for good reason only."""

import os
import socket
from collections.abc import Mapping, MutableMapping
from dataclasses import dataclass

from drivers.clock import NS_PER_S, Clock
from vla_deploy.runtime.one_line import one_line
from vla_deploy.supervisor.status_line import with_late

NS_PER_US = 1000
VARIABLES = ("NOTIFY_SOCKET", "WATCHDOG_USEC", "WATCHDOG_PID")
FEED_EVERY_NS = NS_PER_S
_STATUS_NS = NS_PER_S
_EXTEND_EVERY_NS = 5 * NS_PER_S
_EXTEND_BY_S = 15


@dataclass(frozen=True, slots=True, kw_only=True)
class NotifyTarget:
    """Say where systemd listens and how often its watchdog wants food; "" and 0 for not at all."""

    address: str = ""
    watchdog_ns: int = 0


def notify_target(environment: Mapping[str, str], pid: int) -> NotifyTarget:
    """Return what systemd has asked of the process `pid`."""
    usec = environment.get("WATCHDOG_USEC", "")
    mine = environment.get("WATCHDOG_PID", str(pid)) == str(pid)
    watchdog_ns = int(usec) * NS_PER_US if mine and usec.isdecimal() else 0
    return NotifyTarget(address=environment.get("NOTIFY_SOCKET", ""), watchdog_ns=watchdog_ns)


def hide_from_children(environment: MutableMapping[str, str]) -> None:
    """Remove what only the main process may answer."""
    for name in VARIABLES:
        environment.pop(name, None)


class NotifySocket:
    """Send datagrams to systemd; without an address every call does nothing.

    A full socket is no reason to wait: `refused` counts what was not taken.
    """

    def __init__(self, address: str) -> None:
        self.refused = 0
        self._address = f"\0{address[1:]}" if address.startswith("@") else address
        self._socket: socket.socket | None = None
        if address:
            self._socket = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM | socket.SOCK_CLOEXEC)
            self._socket.setblocking(False)

    def send(self, **assignments: str) -> bool:
        """Send one message; return whether it was taken."""
        if self._socket is None:
            return False
        text = "\n".join(f"{name}={one_line(value)}" for name, value in assignments.items())
        try:
            self._socket.sendto(text.encode(), self._address)
        except OSError:
            self.refused += 1
            return False
        return True

    def close(self) -> None:
        """Close the socket."""
        if self._socket is not None:
            self._socket.close()
            self._socket = None


class Notifier:
    """Notify systemd that the run is ready, in what state it is, and that it is in time.

    The watchdog is fed every second, at half its interval where that is shorter, and only while
    nothing is in trouble: so nearly the whole interval is left to a trouble that mends itself.
    """

    def __init__(self, target: NotifyTarget, clock: Clock) -> None:
        self._socket = NotifySocket(target.address)
        self._clock = clock
        self._feed_every_ns = min(target.watchdog_ns // 2, FEED_EVERY_NS)
        self._fed_ns: int | None = None
        self._told = ""
        self._status_ns: int | None = None
        self._extended_ns: int | None = None
        self._ready = False

    def step(self, *, ready: bool, stopping: bool, status: str, troubles: tuple[str, ...]) -> None:
        """Send what has changed; call it at every step."""
        now_ns = self._clock.now_ns()
        becomes_ready = ready and not stopping and not self._ready
        if becomes_ready:
            self._status_ns = None  # whoever waits for READY reads the status next
        self._tell(with_late(status, troubles), now_ns)
        if becomes_ready:
            self._ready = self._socket.send(READY="1")
        if stopping or not self._ready:
            self._extend(now_ns)
        self._feed(troubles, now_ns, stopping=stopping)

    def stopping(self) -> None:
        """Send that the run is coming to its end."""
        self._socket.send(STOPPING="1")

    def reloading(self) -> None:
        """Send that a profile is being taken over; READY follows with the next step."""
        usec = self._clock.now_ns() // NS_PER_US
        self._socket.send(RELOADING="1", MONOTONIC_USEC=str(usec))
        self._ready = False

    def close(self) -> None:
        """Close the socket."""
        self._socket.close()

    def _extend(self, now_ns: int) -> None:
        """Ask for time while starting and stopping go on: no fixed limit fits every computer."""
        if _is_due(self._extended_ns, _EXTEND_EVERY_NS, now_ns):
            self._extended_ns = now_ns
            self._socket.send(EXTEND_TIMEOUT_USEC=str(_EXTEND_BY_S * 1_000_000))

    def _tell(self, status: str, now_ns: int) -> None:
        if status != self._told and _is_due(self._status_ns, _STATUS_NS, now_ns):
            self._told, self._status_ns = status, now_ns
            self._socket.send(STATUS=status)

    def _feed(self, troubles: tuple[str, ...], now_ns: int, *, stopping: bool) -> None:
        """Feed while in time; a start or a stop that goes on is judged by its own timeouts."""
        if not self._feed_every_ns or (troubles and self._ready and not stopping):
            return
        if _is_due(self._fed_ns, self._feed_every_ns, now_ns):
            self._fed_ns = now_ns
            self._socket.send(WATCHDOG="1")


def _is_due(last_ns: int | None, every_ns: int, now_ns: int) -> bool:
    return last_ns is None or now_ns - last_ns >= every_ns


def own_target() -> NotifyTarget:
    """Return what systemd has asked of this process."""
    return notify_target(os.environ, os.getpid())
