"""Take memory, CPU, disk, cooling and power away from a working robot, and let its clock jump.

The steps of the ladder must be taken in their order and be undone, control must not be late because
of them, nothing may stop or end but what is declared, and the robot must come back by itself.
"""

import argparse
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

from drivers.clock import NS_PER_S, Clock, MonotonicClock
from sim_twin.campaigns.pressed_scene import COOL_C, CannotPress, Scene
from sim_twin.campaigns.report import Case, Report
from sim_twin.campaigns.working_robot import RobotFailed, Ticks

LATE_MARGIN_RATIO: Final = 0.01
"""So many more ticks may be late than before: other users of the computer come and go."""
LATE_FACTOR: Final = 2.0
_SETTLED_S: Final = 5.0
_SETTLE_LIMIT_S: Final = 60.0
_BEFORE_S: Final = 15.0
_HOLD_S: Final = 5.0
_NEXT_JOB_S: Final = 1.0
_DAY_S: Final = 86_400
_JOBS: Final = (
    "look left",
    "pick up the red cup and put it in the box",
    "look right",
    "go to the kitchen",
    "go home",
)
_PROOF: Final = "look left"


@dataclass(frozen=True, slots=True, kw_only=True)
class Trouble:
    """Declare one trouble and all that may follow from it.

    `press` is called again and again with the seconds since it began, `lift` once. `steps` are
    those of the ladder in their order, `metric` the budget's line that must tell of it, `states`
    those in which control may be, `replaced` the processes that may end. The limits are for the
    last step, and for full service once it is over.
    """

    name: str
    press: Callable[[Scene, float], None]
    lift: Callable[[Scene], None]
    steps: tuple[str, ...] = ()
    metric: str = ""
    states: tuple[str, ...] = ("armed",)
    replaced: tuple[str, ...] = ()
    steps_s: float = 30.0
    service_s: float = 60.0
    small_disk: bool = False
    shifted_clock: bool = False


def _ramp(scene: Scene, seconds: float) -> None:
    scene.heat(min(COOL_C + 5.0 * seconds, 92.0))


def _brown_out(scene: Scene, seconds: float) -> None:
    if seconds == 0.0:
        scene.brown_out()


def _fill(scene: Scene, seconds: float) -> None:
    if seconds == 0.0:
        scene.fill_disk()


def _jump(days: int) -> Callable[[Scene, float], None]:
    def press(scene: Scene, seconds: float) -> None:
        if seconds == 0.0:
            scene.shift_clock(days * _DAY_S)

    return press


_OWN_STEPS: Final = ("slow perception", "smaller_model perception", "restart perception")
TROUBLES: Final = (
    Trouble(
        name="memory_hog",
        press=lambda scene, _: scene.wish(memory_mb=700),
        lift=lambda scene: scene.wish(),
        steps=_OWN_STEPS,
        metric="memory_mb",
        replaced=("perception",),
    ),
    Trouble(
        name="cpu_hog",
        press=lambda scene, _: scene.wish(busy_cores=64),
        lift=lambda scene: scene.wish(),
        steps=_OWN_STEPS,
        metric="cpu_ratio",
        replaced=("perception",),
    ),
    Trouble(
        name="disk_full",
        press=_fill,
        lift=lambda scene: scene.free_disk(),
        metric="disk_free_mb",
        small_disk=True,
    ),
    Trouble(
        name="thermal_ramp",
        press=_ramp,
        lift=lambda scene: scene.heat(COOL_C),
        steps=(
            "slow perception",
            "smaller_model perception",
            "suspend planner",
            "protective_stop",
        ),
        metric="temperature_c",
        states=("armed", "protective_stop"),
        replaced=("planner",),
    ),
    Trouble(
        name="brown_out",
        press=_brown_out,
        lift=lambda _: None,
        steps=("protective_stop",),
        states=("armed", "protective_stop"),
    ),
    Trouble(
        name="clock_forward",
        press=_jump(400),
        lift=lambda scene: scene.shift_clock(0),
        shifted_clock=True,
    ),
    Trouble(
        name="clock_back",
        press=_jump(-400),
        lift=lambda scene: scene.shift_clock(0),
        shifted_clock=True,
    ),
)


@dataclass(frozen=True, slots=True, kw_only=True)
class Seen:
    """Hold what one trouble led to; NaN is what never came."""

    taken: tuple[str, ...]
    undone: tuple[str, ...]
    metrics_over: frozenset[str]
    before: Ticks
    during: Ticks
    after: Ticks
    states: frozenset[str]
    replaced: frozenset[str]
    crashed: tuple[str, ...]
    hazards: tuple[str, ...]
    steps_s: float
    service_s: float


def judge(trouble: Trouble, seen: Seen) -> Iterator[str]:
    """Return what was not as declared."""
    if seen.taken != trouble.steps:
        yield f"steps taken: {_listed(seen.taken)}; expected {_listed(trouble.steps)}"
    if seen.undone != tuple(reversed(seen.taken)):
        yield f"steps undone: {_listed(seen.undone)}; expected those taken, the last one first"
    if trouble.metric and trouble.metric not in seen.metrics_over:
        yield f"{trouble.metric} was never told to be over its budget"
    if not seen.steps_s <= trouble.steps_s:
        yield f"the last step after {seen.steps_s:.1f} s, limit {trouble.steps_s:g} s"
    if not seen.service_s <= trouble.service_s:
        yield f"full service after {seen.service_s:.1f} s, limit {trouble.service_s:g} s"
    for what, ticks in (("during it", seen.during), ("after it", seen.after)):
        limit = late_limit(seen.before)
        if ticks.late_ratio > limit:
            yield f"{ticks.late_ratio:.2%} of the ticks late {what}, limit {limit:.2%}"
    if strange := seen.states - set(trouble.states):
        yield f"control was {', '.join(sorted(strange))}"
    if ended := seen.replaced - set(trouble.replaced):
        yield f"{', '.join(sorted(ended))} ended"
    if crashed := sorted(set(seen.crashed) - set(trouble.replaced)):
        yield f"crash reports of {', '.join(crashed)}"
    yield from seen.hazards


def late_limit(before: Ticks) -> float:
    """Return which share of ticks may be late, given the share before."""
    return max(LATE_FACTOR * before.late_ratio, before.late_ratio + LATE_MARGIN_RATIO)


def steps_of(history: Sequence[Mapping[str, Any]], *, taken: bool) -> tuple[str, ...]:
    """Return the steps that a ladder's history tells were taken, or undone, in their order."""
    return tuple(
        " ".join(filter(None, (row["action"], row["process"])))
        for row in history
        if row["taken"] is taken
    )


class Trial:
    """Lead one robot through one trouble."""

    def __init__(self, trouble: Trouble, scene: Scene, clock: Clock) -> None:
        self._trouble = trouble
        self._scene = scene
        self._clock = clock
        self._jobs = 0
        self._next_job_ns = 0
        self._states: set[str] = set()
        self._over: set[str] = set()
        self._history_before = 0

    def run(self) -> Seen:
        """Work, press, lift, and wait for full service."""
        self._settle()
        scene, robot = self._scene, self._scene.robot
        start = robot.ticks()
        self._work(lambda: False, _BEFORE_S)
        before, at_work = robot.ticks().since(start), robot.ticks()
        pids, began_ns = robot.pids(), self._clock.now_ns()
        self._states.clear()
        robot.begin_watch()
        self._trouble.press(scene, 0.0)
        self._work_pressed(began_ns, self._has_answered, self._trouble.steps_s)
        steps_s = self._since(began_ns) if self._has_answered() else math.nan
        self._work_pressed(began_ns, lambda: False, _HOLD_S)
        during, pressed = robot.ticks().since(at_work), robot.ticks()
        self._trouble.lift(scene)
        service_s = self._time_to_service()
        history = self._history()
        later = robot.pids()
        return Seen(
            taken=steps_of(history, taken=True),
            undone=steps_of(history, taken=False),
            metrics_over=frozenset(self._over),
            before=before,
            during=during,
            after=robot.ticks().since(pressed),
            states=frozenset(self._states),
            replaced=frozenset(name for name in pids if later.get(name) != pids[name]),
            crashed=tuple(scene.crashes()),
            hazards=robot.hazards(),
            steps_s=steps_s,
            service_s=service_s,
        )

    def _settle(self) -> None:
        """Wait until nothing of the start is left in the budgets."""
        calm_ns = self._clock.now_ns()

        def settled() -> bool:
            nonlocal calm_ns
            if not self._is_calm():
                calm_ns = self._clock.now_ns()
            return self._since(calm_ns) > _SETTLED_S

        if not self._scene.robot.wait_until(settled, _SETTLE_LIMIT_S):
            raise RobotFailed(f"budgets are not kept without any trouble: {self._scene.budget()}")
        self._history_before = len(self._scene.budget()["ladder"]["history"])

    def _work_pressed(self, began_ns: int, until: Callable[[], bool], limit_s: float) -> None:
        def pressed() -> bool:
            self._trouble.press(self._scene, self._since(began_ns))
            return until()

        self._work(pressed, limit_s)

    def _has_answered(self) -> bool:
        """Tell whether every expected step was taken and every expected line was over."""
        taken = steps_of(self._history(), taken=True)
        trouble = self._trouble
        return len(taken) >= len(trouble.steps) and (
            not trouble.metric or trouble.metric in self._over
        )

    def _time_to_service(self) -> float:
        """Return when the robot had done a job again with every process and no step in force."""
        began_ns, talk = self._clock.now_ns(), self._scene.talk
        limit_s = self._trouble.service_s
        if not self._work(lambda: self._is_calm() and self._scene.robot.is_ready(), limit_s):
            return math.nan
        done = talk.done

        def has_proved() -> bool:
            if not talk.is_busy and talk.done == done:
                talk.say(_PROOF)
            return talk.done > done

        self._look(has_proved, max(limit_s - self._since(began_ns), 0.0))
        return self._since(began_ns) if talk.done > done else math.nan

    def _work(self, until: Callable[[], bool], limit_s: float) -> bool:
        """Give job after job, and look."""

        def work() -> bool:
            if self._scene.talk.is_busy:
                self._next_job_ns = self._clock.now_ns() + round(_NEXT_JOB_S * NS_PER_S)
            elif self._clock.now_ns() >= self._next_job_ns:
                self._scene.talk.say(_JOBS[self._jobs % len(_JOBS)])
                self._jobs += 1
            return until()

        return self._look(work, limit_s)

    def _look(self, until: Callable[[], bool], limit_s: float) -> bool:
        def look() -> bool:
            self._scene.talk.listen()
            self._states.add(self._scene.robot.state())
            rows = self._scene.budget().get("rows", ())
            self._over |= {row["metric"] for row in rows if row["over"]}
            return until()

        return self._scene.robot.wait_until(look, limit_s)

    def _is_calm(self) -> bool:
        budget = self._scene.budget()
        if not budget:
            return False
        over = any(row["over"] or row["state"] == "rising" for row in budget["rows"])
        return not over and budget["ladder"]["step"] == 0 and not budget["stop"]

    def _history(self) -> list[dict[str, Any]]:
        budget = self._scene.budget()
        history: list[dict[str, Any]] = budget["ladder"]["history"] if budget else []
        return history[self._history_before :]

    def _since(self, began_ns: int) -> float:
        return (self._clock.now_ns() - began_ns) / NS_PER_S


def play(trouble: Trouble, seed: int, clock: Clock) -> Case:
    """Give one trouble to a robot of its own and judge what follows."""
    began_ns = clock.now_ns()
    wants = {"small_disk": trouble.small_disk, "shifted_clock": trouble.shifted_clock}
    try:
        with Scene(clock, seed, **wants) as scene:
            seen = Trial(trouble, scene, clock).run()
    except CannotPress as error:
        return Case(name=trouble.name, figures={"skipped": str(error)})
    except RobotFailed as error:
        return Case(name=trouble.name, failures=(str(error),))
    figures = {
        "late_ratio_before": seen.before.late_ratio,
        "late_ratio_during": seen.during.late_ratio,
        "late_ratio_after": seen.after.late_ratio,
        "steps": _listed(seen.taken),
        "steps_s": seen.steps_s,
        "service_s": seen.service_s,
    }
    seconds = (clock.now_ns() - began_ns) / NS_PER_S
    failures = tuple(judge(trouble, seen))
    return Case(name=trouble.name, failures=failures, figures=figures, seconds=seconds)


def run(options: argparse.Namespace, tell: Callable[[str], None]) -> Report:
    """Play every trouble whose name contains `options.only`, one after the other."""
    clock = MonotonicClock()
    cases = []
    for trouble in TROUBLES:
        if options.only in trouble.name:
            cases.append(play(trouble, options.seed, clock))
            tell(cases[-1].row)
    return Report(campaign="pressure", cases=tuple(cases), summary=_summary(cases))


def _summary(cases: Sequence[Case]) -> dict[str, Any]:
    times = [float(case.figures["service_s"]) for case in cases if "service_s" in case.figures]
    return {
        "longest_way_to_full_service_s": max(times, default=math.nan),
        "skipped": sum("skipped" in case.figures for case in cases),
    }


def _listed(steps: Sequence[str]) -> str:
    return ", ".join(steps) or "none"
