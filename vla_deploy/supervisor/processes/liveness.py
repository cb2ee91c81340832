"""Judge by its data and its files whether a process is ready, and whether it stays alive."""

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from drivers.clock import NS_PER_S, Clock
from platforms import Profile
from vla_deploy.ipc import BY_NAME, Sample, SharedSpace
from vla_deploy.supervisor.table import ProcessSpec, Watched


class Readiness:
    """Judge one process of the table by the topic and the files that it promises."""

    def __init__(self, spec: ProcessSpec, run_dir: Path, space: SharedSpace, clock: Clock) -> None:
        self._files = tuple(run_dir / name for name in spec.ready_files)
        self._clock = clock
        self._deadline_s = BY_NAME[spec.ready_topic].deadline_s if spec.ready_topic else 0.0
        self._reader = space.cell_reader(spec.ready_topic) if spec.ready_topic else None

    def forget(self) -> None:
        """Remove what an earlier instance has left, before the next one starts."""
        for path in self._files:
            path.unlink(missing_ok=True)

    def is_ready(self, pid: int) -> bool:
        """Return whether the instance `pid` has done all it promises."""
        return all(path.exists() for path in self._files) and self.is_fresh(pid)

    def is_fresh(self, pid: int) -> bool:
        """Return whether its topic, if it has one, is young and written by `pid`."""
        if self._reader is None:
            return True
        sample = self._reader.latest()
        if sample is None or sample.writer_pid != pid:
            return False
        return sample.age_s(self._clock.now_ns()) <= self._deadline_s


WINDOW_S = 5.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Vital:
    """Report one watched topic; `rate_hz` is None until a window is full, `least_hz` is its limit.

    `faults` are its invalid contents; `alarms` say all that is wrong, for people.
    """

    topic: str
    age_s: float
    rate_hz: float | None
    least_hz: float = 0.0
    faults: tuple[str, ...] = ()
    alarms: tuple[str, ...] = ()


class Liveness:
    """Watch the topics of one process, one instance of it after the other."""

    def __init__(
        self,
        spec: ProcessSpec,
        space: SharedSpace,
        clock: Clock,
        profile: Callable[[], Profile],
    ) -> None:
        self._clock = clock
        self._pulses = [_Pulse(spec.name, row, space, profile) for row in spec.watched]

    def begin(self) -> None:
        """Start over with an instance that is ready now: its silence counts from now on."""
        now_ns = self._clock.now_ns()
        for pulse in self._pulses:
            pulse.begin(now_ns)

    def silence(self, pid: int) -> str:
        """Return which topic has been silent for longer than the table allows, or ""."""
        now_ns = self._clock.now_ns()
        silences = (pulse.silence(pid, now_ns) for pulse in self._pulses)
        return next((words for words in silences if words), "")

    def examine(self, pid: int, rate_ratio: float = 1.0) -> tuple[Vital, ...]:
        """Return age, rate and alarms of every topic; call it at a steady pace.

        `rate_ratio` is the share of its rate at which the process must work.
        """
        now_ns = self._clock.now_ns()
        return tuple(pulse.examine(pid, now_ns, rate_ratio) for pulse in self._pulses)


class _Pulse:
    def __init__(
        self, process: str, row: Watched, space: SharedSpace, profile: Callable[[], Profile]
    ) -> None:
        topic = BY_NAME[row.topic]
        self._name = f"{process}: {row.topic}"
        self._row = row
        self._deadline_s = topic.deadline_s
        self._topic_hz = topic.rate_hz
        self._profile = profile
        self._reader = space.cell_reader(row.topic)
        self._begun_ns = 0
        self._counts: deque[tuple[int, int]] = deque()

    def begin(self, now_ns: int) -> None:
        self._begun_ns = now_ns
        self._counts.clear()

    def silence(self, pid: int, now_ns: int) -> str:
        limit_s = self._row.silence_limit_s
        sample = self._own(pid)
        last_ns = max(self._begun_ns, sample.stamp_ns if sample is not None else 0)
        age_s = (now_ns - last_ns) / NS_PER_S
        if limit_s is None or age_s <= limit_s:
            return ""
        return f"{self._row.topic} silent for {age_s:.1f} s, limit {limit_s:g} s"

    def examine(self, pid: int, now_ns: int, rate_ratio: float) -> Vital:
        sample = self._own(pid)
        age_s = self._age_s(sample, now_ns)
        rate_hz = self._measured_hz(sample, now_ns)
        declared_hz = self._declared_hz() * rate_ratio
        least_hz = declared_hz * self._row.rate_ratio
        alarms = []
        if age_s > self._deadline_s / max(rate_ratio, 0.01):
            alarms.append(f"{self._name}: age {age_s:.2f} s, limit {self._deadline_s:g} s")
        if rate_hz is not None and rate_hz < least_hz:
            alarms.append(
                f"{self._name}: rate {rate_hz:.1f} Hz, limit {least_hz:.1f} Hz of "
                f"{declared_hz:g} Hz declared"
            )
        faults = faults_of(sample)
        alarms += [f"{self._name}.{fault}" for fault in faults]
        return Vital(
            topic=self._row.topic,
            age_s=age_s,
            rate_hz=rate_hz,
            least_hz=least_hz,
            faults=faults,
            alarms=tuple(alarms),
        )

    def _declared_hz(self) -> float:
        """Return the rate of the profile in force, which may change while this runs."""
        name = self._row.profile_rate
        return float(getattr(self._profile(), name)) if name else self._topic_hz

    def _own(self, pid: int) -> Sample | None:
        sample = self._reader.latest()
        return sample if sample is not None and sample.writer_pid == pid else None

    def _age_s(self, sample: Sample | None, now_ns: int) -> float:
        since_ns = self._begun_ns if sample is None else sample.stamp_ns
        return (now_ns - since_ns) / NS_PER_S

    def _measured_hz(self, sample: Sample | None, now_ns: int) -> float | None:
        """Return the rate over the window; it is known once the window is full."""
        if sample is None:
            self._counts.clear()
            return None
        self._counts.append((now_ns, sample.sequence))
        while len(self._counts) > 1 and now_ns - self._counts[1][0] >= WINDOW_S * NS_PER_S:
            self._counts.popleft()
        first_ns, first = self._counts[0]
        if now_ns - first_ns < WINDOW_S * NS_PER_S:
            return None
        return (sample.sequence - first) * NS_PER_S / (now_ns - first_ns)


def faults_of(sample: Sample | None) -> tuple[str, ...]:
    """Return the invalid contents of a topic: numbers not finite, documents that are not JSON."""
    if sample is None:
        return ()
    if sample.dtype is None:
        try:
            sample.document()
        except ValueError as error:
            return (f"document: {error}, expected JSON",)
        return ()
    record = sample.data
    floats = [name for name in sample.dtype.names or () if sample.dtype[name].base.kind == "f"]
    return tuple(
        f"{name}: not finite, expected numbers"
        for name in floats
        if not np.isfinite(record[name]).all()
    )
