"""Judge whether control, safety and buses are each in time: only then is systemd's watchdog fed."""

from collections import deque
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any, Final

from drivers.clock import NS_PER_S, Clock
from vla_deploy.ipc import SharedSpace, topics

WINDOW_NS: Final = 2 * NS_PER_S
STATUS_AGE_S: Final = 1.0
TICK_RATE_RATIO: Final = 0.5
LATE_RATIO: Final = 0.5
LOOP_AGE_S: Final = 2.0
"""How long the supervisor's own loop may be held up."""
JUDGED_TICKS: Final = 2


@dataclass(frozen=True, slots=True, kw_only=True)
class TickCount:
    """Hold control's tick counts at a moment; the pid distinguishes its instances."""

    now_ns: int
    pid: int
    tick: int
    late_ticks: int


class Health:
    """Judge what control publishes of its ticks, its judgements and its buses."""

    def __init__(
        self, space: SharedSpace, clock: Clock, control_rate_hz: Callable[[], float]
    ) -> None:
        self._clock = clock
        self._rate_hz = control_rate_hz
        self._status = space.cell_reader(topics.CONTROL_STATUS)
        self._history: deque[TickCount] = deque()
        self._looked_ns: int | None = None

    def troubles(self) -> tuple[str, ...]:
        """Return what is not in time, each with its limit; call it at every step."""
        now_ns = self._clock.now_ns()
        looked_ns, self._looked_ns = self._looked_ns, now_ns
        gap_s = 0.0 if looked_ns is None else (now_ns - looked_ns) / NS_PER_S
        return (*loop_troubles(gap_s), *self._control_troubles(now_ns))

    def _control_troubles(self, now_ns: int) -> tuple[str, ...]:
        sample = self._status.latest()
        if sample is None:
            return ("control: has not told its status yet",)
        age_s = sample.age_s(now_ns)
        if age_s > STATUS_AGE_S:
            self._history.clear()
            return (f"control: control_status: age {age_s:.2f} s, limit {STATUS_AGE_S:g} s",)
        status = sample.document()
        self._note(
            TickCount(
                now_ns=now_ns,
                pid=sample.writer_pid,
                tick=int(status["tick"]),
                late_ticks=int(status["late_ticks"]),
            )
        )
        return (
            *tick_troubles(self._history[0], self._history[-1], self._rate_hz()),
            *safety_troubles(status),
            *bus_troubles(status),
        )

    def _note(self, ticks: TickCount) -> None:
        if self._history and self._history[-1].pid != ticks.pid:
            self._history.clear()
        self._history.append(ticks)
        while len(self._history) > 1 and ticks.now_ns - self._history[1].now_ns >= WINDOW_NS:
            self._history.popleft()


def loop_troubles(gap_s: float) -> Iterator[str]:
    """Yield a trouble where the supervisor's own loop was held up."""
    if gap_s > LOOP_AGE_S:
        yield f"supervisor: held up for {gap_s:.1f} s, limit {LOOP_AGE_S:g} s"


def tick_troubles(first: TickCount, last: TickCount, rate_hz: float) -> Iterator[str]:
    """Yield a trouble where control ticks too seldom or too late, over a whole window."""
    if last.now_ns - first.now_ns < WINDOW_NS:
        return
    ticks = last.tick - first.tick
    measured_hz = ticks * NS_PER_S / (last.now_ns - first.now_ns)
    least_hz = TICK_RATE_RATIO * rate_hz
    if measured_hz < least_hz:
        yield f"control: tick rate {measured_hz:.0f} Hz, limit {least_hz:.0f} Hz"
    late_ratio = (last.late_ticks - first.late_ticks) / max(ticks, 1)
    if late_ratio > LATE_RATIO:
        yield f"control: late ticks {late_ratio:.0%}, limit {LATE_RATIO:.0%}"


def safety_troubles(status: Mapping[str, Any]) -> Iterator[str]:
    """Yield a trouble where safety has not judged the last ticks."""
    unjudged = int(status["tick"]) - int(status["judged_tick"])
    if unjudged > JUDGED_TICKS:
        yield f"safety: the last {unjudged} ticks were not judged, limit {JUDGED_TICKS}"


def bus_troubles(status: Mapping[str, Any]) -> Iterator[str]:
    """Yield a trouble for each bus that has lost devices.

    None with the emergency stop latched: its button may cut the power of the devices.
    """
    if status["estop_latched"]:
        return
    for name, counters in status["buses"].items():
        lost = _lost_devices(counters)
        if lost:
            yield f"bus {name}: {lost}"


def _lost_devices(counters: Mapping[str, Any]) -> str:
    if not counters:
        return "not open"
    budget = counters.get("budget", {})
    if budget.get("bus") == "lost":
        return "too many answers missing or damaged"
    if budget.get("lost"):
        return f"lost {', '.join(budget['lost'])}"
    lost_nodes = counters.get("lost_nodes", 0)
    return f"lost {lost_nodes} nodes" if lost_nodes else ""
