"""Measure the board and the processes in a thread, and turn that into what budgets limit."""

import logging
import threading
from collections import deque
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Final, Protocol

from drivers.clock import NS_PER_S, Clock
from platforms.probes import Reading
from vla_deploy.supervisor.budgets.judge import TOTAL, Measurement
from vla_deploy.supervisor.processes.usage import Usage, UsageMeter

SAMPLE_PERIOD_S: Final = 0.5
KEPT_SNAPSHOTS: Final = 64
_LOOK_S: Final = 0.05
"""How often, by the wall clock, the thread checks whether a sample is due by the run's clock."""
_log = logging.getLogger(__name__)


class Probes(Protocol):
    """Read the board's numbers."""

    def read(self) -> Mapping[str, Reading]:
        """Return every reading by name."""
        ...

    def close(self) -> None:
        """Give all handles back."""
        ...


@dataclass(frozen=True, slots=True, kw_only=True)
class UsageSnapshot:
    """Hold what was measured in one round; `pids` are the processes that ran then.

    `peak_memory_mb` is of all together since the start, `memory_kind` says how it was measured.
    `wall_ns` is the wall clock's time at `stamp_ns`, which is by the clock of the run.
    """

    stamp_ns: int
    wall_ns: int
    readings: Mapping[str, Reading]
    usages: Mapping[str, Usage]
    pids: Mapping[str, int]
    peak_memory_mb: float
    memory_kind: str


class BackgroundSampler:
    """Measure twice a second in a thread of its own.

    Some sensors take milliseconds to answer, and one that hangs must not block the supervisor. A
    round that fails is logged and counted, and the next one is tried. Rounds are kept for a late
    reader: each holds the events since the one before it.
    """

    def __init__(
        self,
        open_probes: Callable[[], Probes],
        clock: Clock,
        wall: Clock,
        period_s: float = SAMPLE_PERIOD_S,
    ) -> None:
        self._open_probes = open_probes
        self._clock = clock
        self._wall = wall
        self._period_s = period_s
        self._meter = UsageMeter(clock.now_ns())
        self._pids: Mapping[str, int] = {}
        self._kept: deque[UsageSnapshot] = deque(maxlen=KEPT_SNAPSHOTS)
        self._failures = 0
        self._failure = ""
        self._closing = threading.Event()
        self._thread = threading.Thread(target=self._run, name="budget-sampler", daemon=True)
        self._thread.start()

    def watch(self, pids: Mapping[str, int]) -> None:
        """Set which processes run from now on."""
        self._pids = dict(pids)

    def latest(self) -> UsageSnapshot | None:
        """Return the newest snapshot, or None before the first."""
        return self._kept[-1] if self._kept else None

    def since(self, stamp_ns: int) -> tuple[UsageSnapshot, ...]:
        """Return what was measured after a moment, oldest first, as far as it is kept."""
        return tuple(one for one in self._kept.copy() if one.stamp_ns > stamp_ns)

    @property
    def failures(self) -> int:
        """Return how many rounds have failed."""
        return self._failures

    def close(self) -> None:
        """End the thread; one that hangs in a sensor ends with the process."""
        self._closing.set()
        self._thread.join(timeout=2 * self._period_s)

    def _run(self) -> None:
        probes: Probes | None = None
        due_ns = self._clock.now_ns()
        while not self._closing.wait(_LOOK_S):
            if self._clock.now_ns() < due_ns:
                continue
            due_ns = self._clock.now_ns() + round(self._period_s * NS_PER_S)
            # This is the thread's main loop: whatever a system file or a sensor does, the next
            # round may succeed, and without one the ladder would stand still for the whole run.
            try:
                probes = probes or self._open_probes()
                self._kept.append(self._sample(probes))
                self._failure = ""
            except Exception as error:
                self._note_failure(error)
        if probes is not None:
            probes.close()

    def _note_failure(self, error: Exception) -> None:
        """Count a round that failed; the same failure is logged when it begins, not each time."""
        self._failures += 1
        failure = f"{type(error).__name__}: {error}"
        if failure != self._failure:
            self._failure = failure
            _log.warning("budgets: nothing was measured this time: %s", failure, exc_info=error)

    def _sample(self, probes: Probes) -> UsageSnapshot:
        pids, stamp_ns, wall_ns = self._pids, self._clock.now_ns(), self._wall.now_ns()
        usages = self._meter.sample(pids, stamp_ns)
        return UsageSnapshot(
            stamp_ns=stamp_ns,
            wall_ns=wall_ns,
            readings=probes.read(),
            usages=usages,
            pids=pids,
            peak_memory_mb=self._meter.peak_memory_mb,
            memory_kind=self._meter.memory_kind,
        )


Measurements = dict[tuple[str, str], Measurement]

CPU_WINDOW_S: Final = 2.0
_MB: Final = 1_000_000
# The twin stands for the hardware: on a robot it is not there.
OUTSIDE_THE_TOTAL: Final = frozenset({"twin"})
_FROM_READINGS: Final[Mapping[str, tuple[str, float]]] = {
    "power_w": ("power_w", 1.0),
    "temperature_c": ("temperature_c", 1.0),
    "gpu_memory_mb": ("gpu_memory_used_bytes", 1.0 / _MB),
    "disk_free_mb": ("disk_free_bytes", 1.0 / _MB),
}


class Measurer:
    """Keep the snapshots of the last moments: CPU use is a mean over them."""

    def __init__(self) -> None:
        self._recent: deque[UsageSnapshot] = deque()

    def measure(self, snapshot: UsageSnapshot, processes: frozenset[str]) -> Measurements:
        """Return a measurement for every line that a profile may declare."""
        self._remember(snapshot)
        found: Measurements = {}
        for process in sorted(processes):
            found["memory_mb", process] = self._of(process, self._memory_mb(process))
            found["cpu_ratio", process] = self._of(process, self._cpu_ratio(process))
        counted = [name for name in snapshot.usages if name not in OUTSIDE_THE_TOTAL]
        found["memory_mb", TOTAL] = _sum([self._memory_mb(name) for name in counted])
        found["cpu_ratio", TOTAL] = _sum([self._cpu_ratio(name) for name in counted])
        for metric, (name, scale) in _FROM_READINGS.items():
            found[metric, TOTAL] = _scaled(snapshot.readings.get(name), name, scale)
        return found

    def _remember(self, snapshot: UsageSnapshot) -> None:
        self._recent.append(snapshot)
        oldest_ns = snapshot.stamp_ns - round(CPU_WINDOW_S * NS_PER_S)
        while len(self._recent) > 2 and self._recent[1].stamp_ns <= oldest_ns:
            self._recent.popleft()

    def _of(self, process: str, value: float | None) -> Measurement:
        if process not in self._recent[-1].pids:
            return Measurement(value=None, reason="it does not run", ended=True)
        if value is None:
            return Measurement(value=None, reason="it was not measured yet")
        return Measurement(value=value)

    def _memory_mb(self, process: str) -> float | None:
        """Return what a process holds; on a Jetson its GPU memory is part of the same memory."""
        newest = self._recent[-1]
        usage = newest.usages.get(process)
        if usage is None:
            return None
        on_gpu = newest.readings.get(f"gpu_memory_used_bytes.{newest.pids.get(process)}")
        gpu_bytes = on_gpu.value if on_gpu is not None and on_gpu.value is not None else 0.0
        return usage.memory_mb + gpu_bytes / _MB

    def _cpu_ratio(self, process: str) -> float | None:
        newest = self._recent[-1]
        oldest = next((one for one in self._recent if process in one.usages), newest)
        # A twin's time may be slower or faster than the wall's. What is done by either of them is
        # no more per second than on a robot, where both are one.
        elapsed_ns = max(newest.stamp_ns - oldest.stamp_ns, newest.wall_ns - oldest.wall_ns)
        elapsed_s = elapsed_ns / NS_PER_S
        if process not in newest.usages or elapsed_s <= 0.0:
            return None
        return (newest.usages[process].cpu_s - oldest.usages[process].cpu_s) / elapsed_s


def _sum(values: list[float | None]) -> Measurement:
    known = [value for value in values if value is not None]
    if not known or len(known) < len(values):
        return Measurement(value=None, reason="not every process was measured yet")
    return Measurement(value=sum(known))


def _scaled(reading: Reading | None, name: str, scale: float) -> Measurement:
    if reading is None:
        return Measurement(value=None, reason=f"no probe reads {name}")
    if reading.value is None:
        return Measurement(value=None, reason=reading.reason)
    return Measurement(value=reading.value * scale)
