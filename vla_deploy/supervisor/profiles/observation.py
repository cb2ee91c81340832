"""Observe for a while what a running robot needs of its computer, and which rates it keeps."""

import math
import statistics
from collections import defaultdict
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any, Final

from drivers.clock import NS_PER_S
from platforms import Profile
from vla_deploy.client.link import RobotLink
from vla_deploy.ipc import topics
from vla_deploy.ipc.payloads.supervision import ProcessTable

LOOK_S: Final = 1.0
KEPT_RATIO: Final = 0.95
"""A rate of which less is reached was promised in vain."""
LATE_RATIO: Final = 0.01
"""Of control's ticks, by the wall clock."""
STAND_IN: Final = "twin"
"""It stands for the world: a robot has none."""
_USUAL_SHARE: Final = 0.95


@dataclass(frozen=True, slots=True, kw_only=True)
class ProcessNeed:
    """Hold what a process took: CPU, in cores, of 95 % of the looks; the most memory."""

    cpu_ratio: float
    memory_mb: float


@dataclass(frozen=True, slots=True, kw_only=True)
class PacedRate:
    """Hold a rate as the profile declares it and as it was reached, over the whole time."""

    declared_hz: float
    reached_hz: float

    @property
    def kept(self) -> bool:
        """Return whether it was reached."""
        return self.reached_hz >= KEPT_RATIO * self.declared_hz


@dataclass(frozen=True, slots=True, kw_only=True)
class Observation:
    """Hold what was seen of one run; `rates` are by their keys of the profile.

    `late_ratio` is the share of control's late ticks, None on the twin's time, which waits for a
    late process. `hottest_c` is None where the board tells no temperature. `busy_ratio` says how
    much of the time the robot did something.
    """

    robot: str
    seconds: float
    busy_ratio: float
    processes: Mapping[str, ProcessNeed]
    rates: Mapping[str, PacedRate]
    late_ratio: float | None
    hottest_c: float | None

    @property
    def cpu_ratio(self) -> float:
        """Return the cores that all processes of a robot need together."""
        return sum(need.cpu_ratio for need in self.processes.values())

    @property
    def troubles(self) -> tuple[str, ...]:
        """Return what of the profile was not kept, in words."""
        broken = [
            f"{key}: reached {rate.reached_hz:.3g} Hz of {rate.declared_hz:g} Hz"
            for key, rate in self.rates.items()
            if not rate.kept
        ]
        if self.late_ratio is not None and self.late_ratio > LATE_RATIO:
            broken.append(f"control: {self.late_ratio:.1%} of its ticks late, limit 1%")
        return tuple(broken)


@dataclass(frozen=True, slots=True, kw_only=True)
class _Count:
    pid: int
    number: int
    late: int = 0


class Observer:
    """Look at a run's topics now and then, and sum up what they told."""

    def __init__(self, link: RobotLink, profile: Profile, *, on_twin_time: bool) -> None:
        self._link = link
        self._declared: dict[str, float] = {
            "control_rate_hz": profile.control_rate_hz,
            "perception_rate_hz": profile.perception_rate_hz,
        }
        self._on_twin_time = on_twin_time
        self._began_ns = link.clock.now_ns()
        self._robot = ""
        self._cpu: dict[str, list[float]] = defaultdict(list)
        self._memory: dict[str, float] = {}
        self._busy: list[bool] = []
        self._hottest_c: list[float] = []
        self._first: dict[str, tuple[int, _Count]] = {}
        self._last: dict[str, tuple[int, _Count]] = {}

    def look(self) -> None:
        """Take in what is told now; call it about once in `LOOK_S`."""
        table = self._link.document(topics.PROCESS_TABLE)
        if table is not None:
            self._take_in(table)
        activity = self._link.document(topics.ACTIVITY)
        if activity is not None:
            self._busy.append(activity["activity"] in ("navigating", "manipulating"))
        board = self._link.document(topics.BOARD)
        if board is not None and "temperature_c" in board["readings"]:
            self._hottest_c.append(board["readings"]["temperature_c"])
        self._count("control_rate_hz", self._ticks())
        self._count("perception_rate_hz", self._images())

    def observation(self) -> Observation:
        """Return what was seen until now."""
        return Observation(
            robot=self._robot,
            seconds=(self._link.clock.now_ns() - self._began_ns) / NS_PER_S,
            busy_ratio=statistics.fmean(self._busy) if self._busy else 0.0,
            processes={
                name: ProcessNeed(cpu_ratio=_usual(looks), memory_mb=self._memory[name])
                for name, looks in self._cpu.items()
            },
            rates=dict(self._rates()),
            late_ratio=None if self._on_twin_time else self._late_ratio(),
            hottest_c=max(self._hottest_c, default=None),
        )

    def _take_in(self, table: ProcessTable) -> None:
        self._robot = table["robot"]
        rows: list[Mapping[str, Any]] = [*table["processes"]]
        for row in (*rows, {"name": "supervisor", **table["supervisor"]}):
            name, cpu_ratio, memory_mb = row["name"], row["cpu_ratio"], row["memory_mb"]
            if name == STAND_IN or cpu_ratio is None or memory_mb is None:
                continue
            self._cpu[name].append(cpu_ratio)
            self._memory[name] = max(memory_mb, self._memory.get(name, 0.0))

    def _count(self, key: str, count: _Count | None) -> None:
        if count is None:
            return
        now_ns = self._link.clock.now_ns()
        if key not in self._first or self._first[key][1].pid != count.pid:
            self._first[key] = now_ns, count  # another process counts anew
        self._last[key] = now_ns, count

    def _ticks(self) -> _Count | None:
        sample = self._link.fresh(topics.CONTROL_STATUS)
        if sample is None:
            return None
        status = sample.document()
        return _Count(pid=sample.writer_pid, number=status["tick"], late=status["late_ticks"])

    def _images(self) -> _Count | None:
        frame = self._link.frame(topics.RGBD, math.inf)
        return None if frame is None else _Count(pid=frame.writer_pid, number=frame.sequence)

    def _rates(self) -> Iterator[tuple[str, PacedRate]]:
        for key, (last_ns, last) in self._last.items():
            first_ns, first = self._first[key]
            if last_ns > first_ns:
                hz = (last.number - first.number) * NS_PER_S / (last_ns - first_ns)
                yield key, PacedRate(declared_hz=self._declared[key], reached_hz=hz)

    def _late_ratio(self) -> float | None:
        if "control_rate_hz" not in self._last:
            return None
        first, last = self._first["control_rate_hz"][1], self._last["control_rate_hz"][1]
        return (last.late - first.late) / max(last.number - first.number, 1)


def _usual(looks: list[float]) -> float:
    return sorted(looks)[int(_USUAL_SHARE * (len(looks) - 1))]
