"""Switch profiles again and again while joints move, in the real processes; some profiles are bad.

Control must neither stop nor be later than before, no process may grow with the switches, and a
profile that cannot be kept is refused or taken back, with the robot at work all the while.
"""

import argparse
import itertools
import tempfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np

from drivers.clock import NS_PER_S, MonotonicClock
from sim_twin.campaigns.report import Case, Report
from sim_twin.campaigns.working_robot import RobotFailed, Ticks, WorkingRobot

SWITCHES: Final = 100
MOST_MIB_PER_SWITCH: Final = 0.05
"""A hundred switches may leave 5 MiB: allocators and caches never stand quite still."""
FEWEST_FOR_A_SLOPE: Final = 40
LATE_MARGIN_RATIO: Final = 0.01
"""So many more ticks may be late than before: other users of the computer come and go."""
LATE_FACTOR: Final = 2.0
LEAST_RATE_RATIO: Final = 0.9
LEAST_MOTION_RAD: Final = 0.05
_WARM_UP_RATIO: Final = 0.25
_BEFORE_S: Final = 10.0
_AFTER_BAD_S: Final = 2.0
_SWING_S: Final = 2.5

# Rates that two cores keep beside the twin; the drives' period may change in motion.
GOOD: Final[Mapping[str, str]] = {
    "swift": """inherits = "desktop"
control_rate_hz = 125
executor_rate_hz = 25
[budgets]
perception = { memory_mb = 600, cpu_ratio = 1.2 }
""",
    "calm": """inherits = "desktop"
control_rate_hz = 100
executor_rate_hz = 20
perception_rate_hz = 4
camera_rate_hz = 4
[budgets]
perception = { memory_mb = 550, cpu_ratio = 1.0 }
planner = { memory_mb = 200, cpu_ratio = 0.3 }
""",
}


@dataclass(frozen=True, slots=True, kw_only=True)
class Bad:
    """Declare a profile that must not stay: its text, how that may end, a word of the reason."""

    name: str
    text: str
    outcomes: tuple[str, ...]
    reason: str


_LIKE_SWIFT: Final = 'inherits = "desktop"\ncontrol_rate_hz = 125\nexecutor_rate_hz = 25\n'
BAD: Final = (
    Bad(
        name="not_toml",
        text=_LIKE_SWIFT + "perception_rate_hz = \n",
        outcomes=("refused",),
        reason="not_toml.toml",
    ),
    Bad(
        name="out_of_range",
        text='inherits = "desktop"\ncontrol_rate_hz = 9000\n',
        outcomes=("refused",),
        reason="control_rate_hz",
    ),
    Bad(
        name="unknown_key",
        text=_LIKE_SWIFT + "speed = 3\n",
        outcomes=("refused",),
        reason="speed",
    ),
    Bad(
        name="process_refuses",
        text=_LIKE_SWIFT + "bus_watchdog_s = 0.5\n",
        outcomes=("refused",),
        reason="control",
    ),
    Bad(
        name="memory_not_kept",
        text=_LIKE_SWIFT + "[budgets]\nplanner = { memory_mb = 10, cpu_ratio = 0.2 }\n",
        outcomes=("rolled back",),
        reason="planner",
    ),
    Bad(
        name="computer_too_small",
        text=_LIKE_SWIFT
        + "[board]\nmemory_mb = 200000\n[budgets.total]\nmemory_mb = 190000\ncpu_ratio = 3.5\n",
        outcomes=("refused",),
        reason="memory",
    ),
)


@dataclass(frozen=True, slots=True, kw_only=True)
class Seen:
    """Hold what was measured across one switch; memory is each process' own, in MiB."""

    outcome: str
    reason: str
    seconds: float
    ticks: Ticks
    least_rate_hz: float
    moved_rad: float
    states: frozenset[str]
    memory_mib: Mapping[str, float]


def late_limit(before: Ticks) -> float:
    """Return which share of ticks may be late, given the share without any switch."""
    return max(LATE_FACTOR * before.late_ratio, before.late_ratio + LATE_MARGIN_RATIO)


def judge(seen: Seen, outcomes: Sequence[str], reason: str = "") -> Iterator[str]:
    """Return what was wrong with one switch; late ticks are judged over all of them."""
    if seen.outcome not in outcomes:
        yield f"{seen.outcome} ({seen.reason}), expected {' or '.join(outcomes)}"
    elif reason not in seen.reason:
        yield f"the reason is {seen.reason!r}, expected a word about {reason}"
    if seen.states != {"armed"}:
        strange = ", ".join(sorted(seen.states - {"armed"})) or "never looked at"
        yield f"control was {strange}"
    expected = LEAST_RATE_RATIO * seen.least_rate_hz * seen.seconds
    if seen.ticks.ticks < expected:
        yield f"{seen.ticks.ticks} ticks in {seen.seconds:.1f} s, expected {expected:.0f}"
    if seen.moved_rad < LEAST_MOTION_RAD:
        yield f"moved {seen.moved_rad:.3f} rad, expected {LEAST_MOTION_RAD} at least"


def slopes(history: Sequence[Seen]) -> dict[str, float]:
    """Return by how many MiB each process grows with a switch, after the warm-up."""
    warm = history[round(_WARM_UP_RATIO * len(history)) :]
    if len(warm) < 2:
        return {}
    numbers = np.arange(len(warm), dtype=float)
    return {
        name: float(
            np.polynomial.Polynomial.fit(numbers, [seen.memory_mib[name] for seen in warm], 1)
            .convert()
            .coef[-1]
        )
        for name in warm[0].memory_mib
        if all(name in seen.memory_mib for seen in warm)
    }


def memory_case(history: Sequence[Seen]) -> Case:
    """Return the verdict about memory; too few switches give figures without a verdict."""
    found = slopes(history)
    enough = len(history) >= FEWEST_FOR_A_SLOPE
    failures = tuple(
        f"{name} grows by {slope:.3f} MiB per switch, limit {MOST_MIB_PER_SWITCH:g}"
        for name, slope in found.items()
        if enough and slope > MOST_MIB_PER_SWITCH
    )
    figures: dict[str, Any] = {f"{name}_mib_per_switch": slope for name, slope in found.items()}
    if not enough:
        figures["not_judged"] = f"{len(history)} switches, {FEWEST_FOR_A_SLOPE} are needed"
    return Case(name="memory", failures=failures, figures=figures)


def ticks_case(before: Ticks, history: Sequence[Seen]) -> Case:
    """Return the verdict about late ticks across all switches."""
    during = total(seen.ticks for seen in history)
    limit = late_limit(before)
    failures = (
        (f"{during.late_ratio:.2%} of the ticks late, limit {limit:.2%}",)
        if during.late_ratio > limit
        else ()
    )
    figures = {
        "before_late_ratio": before.late_ratio,
        "late_ratio": during.late_ratio,
        "ticks": during.ticks,
        "late_ticks": during.late,
    }
    return Case(name="deadlines", failures=failures, figures=figures)


def total(parts: Iterator[Ticks]) -> Ticks:
    """Return all ticks together."""
    counted = list(parts)
    return Ticks(ticks=sum(one.ticks for one in counted), late=sum(one.late for one in counted))


class SwitchCampaign:
    """Own a robot whose joints go to and fro for as long as it lives."""

    def __init__(self, folder: Path, seed: int) -> None:
        self._clock = MonotonicClock()
        self._paths = {
            name: _written(folder, name, text)
            for name, text in {**GOOD, **{bad.name: bad.text for bad in BAD}}.items()
        }
        self._now = "swift"
        words = ("--profile", str(self._paths["swift"]), "--seed", str(seed))
        self._robot = WorkingRobot(folder / "run", self._clock, *words, log=folder / "robot.log")
        self._targets = itertools.cycle((0.6, -0.6))
        self._swing_ns = 0
        self._meter = _Meter(self._robot)

    def before(self) -> Ticks:
        """Return the ticks of a while without any switch, in the same motion."""
        start = self._robot.ticks()
        self._keep_moving(_BEFORE_S)
        return self._robot.ticks().since(start)

    def switch(self, number: int) -> tuple[Seen, Case]:
        """Take the robot to the other profile."""
        target = "calm" if self._now == "swift" else "swift"
        rate_hz = min(_rate_hz(self._now), _rate_hz(target))
        seen = self._seen(target, rate_hz)
        failures = list(judge(seen, ("kept",)))
        self._now = target if seen.outcome == "kept" else self._now
        return seen, _case(f"{number:03d}/{target}", failures, seen)

    def refuse(self, bad: Bad) -> Case:
        """Ask for a profile that must not stay."""
        in_force = self._robot.document("profile_status").get("profile")
        seen = self._seen(bad.name, _rate_hz(self._now), _AFTER_BAD_S)
        failures = list(judge(seen, bad.outcomes, bad.reason))
        left = self._robot.document("profile_status").get("profile")
        if left != in_force:
            failures.append(f"profile {left} in force, expected {in_force} as before")
        return _case(f"bad/{bad.name}", failures, seen)

    def close(self) -> None:
        """End the robot."""
        self._robot.close()

    def _seen(self, target: str, least_rate_hz: float, after_s: float = 0.0) -> Seen:
        began_ns, start = self._clock.now_ns(), self._robot.ticks()
        self._meter.begin()
        last = self._robot.use_profile(self._paths[target], meanwhile=self._look)
        self._keep_moving(after_s)
        seconds = (self._clock.now_ns() - began_ns) / NS_PER_S
        return Seen(
            outcome=last["outcome"],
            reason=last["reason"],
            seconds=seconds,
            ticks=self._robot.ticks().since(start),
            least_rate_hz=least_rate_hz,
            moved_rad=self._meter.moved_rad,
            states=frozenset(self._meter.states),
            memory_mib=self._robot.memory_mib(),
        )

    def _keep_moving(self, duration_s: float) -> None:
        end_ns = self._clock.now_ns() + round(duration_s * NS_PER_S)
        self._robot.wait_until(lambda: self._look() or self._clock.now_ns() > end_ns, duration_s)

    def _look(self) -> bool:
        """Send the joints back from time to time and note how control is; never true."""
        self._meter.look()
        if self._clock.now_ns() >= self._swing_ns:
            self._swing_ns = self._clock.now_ns() + round(_SWING_S * NS_PER_S)
            side = next(self._targets)
            self._robot.go(head_pan=side, left_wrist_roll=1.2 + side)
        return False


class _Meter:
    """Note control's states and how far the setpoints go."""

    def __init__(self, robot: WorkingRobot) -> None:
        self._robot = robot
        self.begin()

    def begin(self) -> None:
        """Forget what was seen."""
        self.states: set[str] = set()
        self.moved_rad = 0.0
        self._before: np.ndarray[Any, np.dtype[np.float64]] | None = None

    def look(self) -> None:
        """Look once."""
        self.states.add(self._robot.state())
        place = np.array(self._robot.setpoint())
        if self._before is not None and len(place) == len(self._before):
            self.moved_rad += float(np.abs(place - self._before).max(initial=0.0))
        self._before = place


def run(options: argparse.Namespace, tell: Callable[[str], None]) -> Report:
    """Switch `options.count` times, 100 unless told otherwise, then ask for every bad profile."""
    count = SWITCHES if options.count is None else options.count
    history: list[Seen] = []
    cases: list[Case] = []
    before = Ticks(ticks=0, late=0)
    with tempfile.TemporaryDirectory(prefix="vla-switch-") as folder:
        try:
            campaign = SwitchCampaign(Path(folder), options.seed)
        except RobotFailed as error:
            return Report(campaign="switches", cases=(Case(name="start", failures=(str(error),)),))
        try:
            before = campaign.before()
            for number in range(count):
                seen, case = campaign.switch(number)
                history.append(seen)
                cases.append(_told(case, tell))
            cases += [_told(campaign.refuse(bad), tell) for bad in BAD if options.only in bad.name]
        except RobotFailed as error:
            cases.append(_told(Case(name="robot", failures=(str(error),)), tell))
        finally:
            campaign.close()
    cases += [_told(ticks_case(before, history), tell), _told(memory_case(history), tell)]
    return Report(campaign="switches", cases=tuple(cases), summary=_summary(cases, history))


def _summary(cases: Sequence[Case], history: Sequence[Seen]) -> dict[str, Any]:
    figures = {key: value for case in cases[-2:] for key, value in case.figures.items()}
    kept = sum(seen.outcome == "kept" for seen in history)
    longest_s = max((seen.seconds for seen in history), default=0.0)
    return {"switches": len(history), "kept": kept, "longest_switch_s": longest_s, **figures}


def _case(name: str, failures: Sequence[str], seen: Seen) -> Case:
    figures = {
        "outcome": seen.outcome,
        "ticks": seen.ticks.ticks,
        "late": seen.ticks.late,
        "moved_rad": seen.moved_rad,
        "reason": seen.reason,
    }
    return Case(name=name, failures=tuple(failures), figures=figures, seconds=seen.seconds)


def _told(case: Case, tell: Callable[[str], None]) -> Case:
    tell(case.row)
    return case


def _rate_hz(name: str) -> float:
    lines = dict(line.split(" = ", 1) for line in GOOD[name].splitlines() if " = " in line)
    return float(lines["control_rate_hz"])


def _written(folder: Path, name: str, text: str) -> Path:
    path = folder / f"{name}.toml"
    path.write_text(text, encoding="utf-8")
    return path
