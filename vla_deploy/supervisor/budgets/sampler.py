"""Measure the board and the processes beside the supervisor's loop, never in it."""

import logging
import threading
from collections import deque
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Final, Protocol

from drivers.clock import NS_PER_S, Clock
from platforms.probes import Reading
from vla_deploy.supervisor.processes.usage import Usage, UsageMeter

SAMPLE_PERIOD_S: Final = 0.5
KEPT_SNAPSHOTS: Final = 64
_LOOK_S: Final = 0.05
"""How often, by the wall clock, it is looked whether a sample is due on the clock of the run."""
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
    """Carry what was measured in one round; `pids` are the processes that ran then.

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


class SnapshotFeed(Protocol):
    """Hand out the newest snapshot without waiting."""

    def watch(self, pids: Mapping[str, int]) -> None:
        """Say which processes run from now on."""
        ...

    def latest(self) -> UsageSnapshot | None:
        """Return the newest snapshot, or None before the first."""
        ...

    def since(self, stamp_ns: int) -> tuple[UsageSnapshot, ...]:
        """Return what was measured after a moment, oldest first."""
        ...

    @property
    def failures(self) -> int:
        """Return how many rounds have failed."""
        ...

    def close(self) -> None:
        """Measure no more."""
        ...


class BackgroundSampler:
    """Measure twice a second in a thread of its own.

    Some sensors take milliseconds to answer, and one that hangs must not hold the supervisor up. A
    round that fails is logged and counted, and the next one is tried. Rounds are kept for a reader
    that is late: each holds the events since the one before it.
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
        """Say which processes run from now on."""
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
