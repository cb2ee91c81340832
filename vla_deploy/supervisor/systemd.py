"""Report to systemd: the status line, the notify protocol and its watchdog, the unit's times."""

import math
import os
import socket
from collections.abc import Mapping, MutableMapping, Sequence
from dataclasses import dataclass
from typing import Final

from drivers.clock import NS_PER_S, Clock
from vla_deploy.runtime.one_line import one_line
from vla_deploy.supervisor.processes.lifecycle import (
    ABORT_GRACE_NS,
    SETTLED,
    TROUBLED,
    ProcessRecord,
    ProcessState,
    delay_s,
)
from vla_deploy.supervisor.table import TABLE, GivingUp, ProcessSpec

DEGRADED = "degraded"
LATE = "not in time"


def status_line(records: Mapping[str, ProcessRecord], *, stopping: bool, fault: str = "") -> str:
    """Return which processes are not ready, and why; then the `fault` that a person must repair."""
    return _processes(records, stopping=stopping) + (fault and f"; {fault}")


def _processes(records: Mapping[str, ProcessRecord], *, stopping: bool) -> str:
    wanted = {
        name: record for name, record in records.items() if record.state is not ProcessState.OFF
    }
    if stopping:
        left = [name for name, record in wanted.items() if record.state is not ProcessState.STOPPED]
        return f"stopping: {', '.join(left) or 'nobody'} left"
    troubles = [
        f"{name} {record.state.value} ({record.reason})"
        for name, record in wanted.items()
        if record.state in TROUBLED
    ]
    if troubles:
        return f"{DEGRADED}: {'; '.join(troubles)}"
    pending = [name for name, record in wanted.items() if record.state not in SETTLED]
    if pending:
        return f"starting {pending[0]}: {len(wanted) - len(pending)} of {len(wanted)} ready"
    return f"all {len(wanted)} processes ready"


def with_late(status: str, troubles: Sequence[str]) -> str:
    """Add the first of what is not in time."""
    return f"{status}; {LATE}: {troubles[0]}" if troubles else status


def trouble_in(status: str) -> str:
    """Return a status that names a process that fails or is late; "" for any other."""
    return status if status.startswith(DEGRADED) or f"; {LATE}: " in status else ""


NS_PER_US = 1000
VARIABLES = ("NOTIFY_SOCKET", "WATCHDOG_USEC", "WATCHDOG_PID")
FEED_EVERY_NS = NS_PER_S
_STATUS_NS = NS_PER_S
_EXTEND_EVERY_NS = 5 * NS_PER_S
_EXTEND_BY_S = 15


@dataclass(frozen=True, slots=True, kw_only=True)
class NotifyTarget:
    """Name the socket of systemd and the interval of its watchdog; "" and 0 for none."""

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

    It never waits for a full socket: `refused` counts what was not taken.
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
    nothing is in trouble: a trouble has nearly the whole interval to pass.
    """

    def __init__(self, target: NotifyTarget, clock: Clock) -> None:
        self._socket = NotifySocket(target.address)
        self._clock = clock
        self._feed_every_ns = min(target.watchdog_ns // 2, FEED_EVERY_NS)
        self._fed_ns: int | None = None
        self._sent_status = ""
        self._status_ns: int | None = None
        self._extended_ns: int | None = None
        self._ready = False

    def step(self, *, ready: bool, stopping: bool, status: str, troubles: tuple[str, ...]) -> None:
        """Send what has changed; call it at every step."""
        now_ns = self._clock.now_ns()
        becomes_ready = ready and not stopping and not self._ready
        if becomes_ready:
            self._status_ns = None  # who waits for READY reads the status next
        self._send_status(with_late(status, troubles), now_ns)
        if becomes_ready:
            self._ready = self._socket.send(READY="1")
        if stopping or not self._ready:
            self._extend(now_ns)
        self._feed(troubles, now_ns, stopping=stopping)

    def stopping(self) -> None:
        """Send that the run is coming to its end."""
        self._socket.send(STOPPING="1")

    def close(self) -> None:
        """Close the socket."""
        self._socket.close()

    def _extend(self, now_ns: int) -> None:
        """Ask for more time while it starts or stops: no fixed limit fits every computer."""
        if _is_due(self._extended_ns, _EXTEND_EVERY_NS, now_ns):
            self._extended_ns = now_ns
            self._socket.send(EXTEND_TIMEOUT_USEC=str(_EXTEND_BY_S * 1_000_000))

    def _send_status(self, status: str, now_ns: int) -> None:
        if status != self._sent_status and _is_due(self._status_ns, _STATUS_NS, now_ns):
            self._sent_status, self._status_ns = status, now_ns
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


RESTART_S: Final = 2
START_BURST: Final = 5
_FEEDER: Final = "control"  # the watchdog is not fed while its status is old
_CONTROL_START_S: Final = 8.0
_S_PER_MINUTE: Final = 60


def watchdog_s(table: Sequence[ProcessSpec] = TABLE) -> int:
    """Return the watchdog's interval: the time to notice a control that hangs and to restart it.

    The age at which a status is too old equals the time since the last feeding: both cancel out.
    """
    (spec,) = (spec for spec in table if spec.name == _FEEDER)
    limits_s = [topic.silence_limit_s for topic in spec.watched if topic.silence_limit_s]
    ended_s = min(limits_s) + ABORT_GRACE_NS / NS_PER_S
    return math.ceil(ended_s + delay_s(spec.restart, 1) + _CONTROL_START_S)


def start_limit_s(table: Sequence[ProcessSpec] = TABLE) -> int:
    """Return within what time `START_BURST` failed starts end the service, in whole minutes.

    It is long enough for the slowest failures: else the service would be started for ever.
    """
    once_s = longest_start_s(table) + sum(spec.stop_timeout_s for spec in table) + RESTART_S
    return math.ceil(START_BURST * once_s / _S_PER_MINUTE) * _S_PER_MINUTE


def longest_start_s(table: Sequence[ProcessSpec] = TABLE) -> float:
    """Return the longest time of a start that fails because one process never gets ready."""
    before_s = stage_s = longest_s = 0.0
    for spec in table:
        if not spec.with_previous:
            before_s, stage_s = before_s + stage_s, 0.0
        stage_s = max(stage_s, spec.ready_timeout_s)
        if spec.giving_up is not GivingUp.CARRY_ON:
            longest_s = max(longest_s, before_s + give_up_s(spec))
    return longest_s


def give_up_s(spec: ProcessSpec) -> float:
    """Return how long a process that never gets ready is tried at most before it is given up."""
    policy = spec.restart
    once_s = spec.ready_timeout_s + ABORT_GRACE_NS / NS_PER_S
    pauses_s = sum(delay_s(policy, failures) for failures in range(1, policy.max_restarts + 1))
    return (policy.max_restarts + 1) * once_s + pauses_s
