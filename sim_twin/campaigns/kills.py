"""Kill, freeze and end every process of the robot at random moments of its work.

The machine is a twin that runs by itself, so physics goes on and judges whatever dies. The robot
runs as a service does, restarted and watched by `sim_twin.service_runner` in systemd's place.
"""

import argparse
import math
import random
import signal
import tempfile
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Final

from drivers.clock import NS_PER_S, MonotonicClock
from sim_twin.campaigns.kill_failures import is_void, late, late_ready, wrong_state
from sim_twin.campaigns.machine import Machine
from sim_twin.campaigns.report import Case, Report, told
from sim_twin.campaigns.robot_service import NotReady, RobotService
from sim_twin.campaigns.selection import chosen
from sim_twin.stillness import StillnessWatch
from sim_twin.truth import STANDSTILL_RAD_S, fastest_joint
from vla_deploy.supervisor.table import RestartPolicy

SIGNALS: Final = (signal.SIGKILL, signal.SIGSTOP, signal.SIGTERM)
_COMMANDS: Final = (
    "pick up the red cup and put it in the box",
    "go to the kitchen",
    "pick up the blue ball and put it on the coffee table",
    "go to the charging station",
)
_EARLIEST_S, _LATEST_S = 0.5, 9.0
_REST_FOR_S: Final = 0.3
_POLL_S: Final = 0.02
_SETTLE_S: Final = 1.0
_TRIES: Final = 3


@dataclass(frozen=True, slots=True, kw_only=True)
class Rule:
    """Declare what must follow from the end of a process.

    `rest_s` is until when everything rests, None where the robot may carry on; `ready_s` until when
    all processes are ready again without a hand; `states` are those in which control then may be.
    Where it `ends`, a person has asked for it: `ready_s` is until when the service has ended.
    """

    rest_s: float | None
    ready_s: float
    states: tuple[str, ...]
    ends: bool = False


_CARRIES_ON: Final = ("armed",)
_WANTS_A_HAND: Final = ("disarmed", "stopped", "fault")
# A frozen process is noticed by its silence, so it takes its row's limit longer than a dead one.
RULES: Final[Mapping[tuple[str, signal.Signals], Rule]] = {
    ("control", signal.SIGKILL): Rule(rest_s=1.5, ready_s=30.0, states=_WANTS_A_HAND),
    ("control", signal.SIGSTOP): Rule(rest_s=1.5, ready_s=40.0, states=_WANTS_A_HAND),
    ("control", signal.SIGTERM): Rule(rest_s=4.0, ready_s=30.0, states=_WANTS_A_HAND),
    ("stop_door", signal.SIGKILL): Rule(rest_s=None, ready_s=30.0, states=_CARRIES_ON),
    ("stop_door", signal.SIGSTOP): Rule(rest_s=None, ready_s=40.0, states=_CARRIES_ON),
    ("stop_door", signal.SIGTERM): Rule(rest_s=None, ready_s=30.0, states=_CARRIES_ON),
    ("executor", signal.SIGKILL): Rule(rest_s=6.0, ready_s=30.0, states=_CARRIES_ON),
    ("executor", signal.SIGSTOP): Rule(rest_s=6.0, ready_s=40.0, states=_CARRIES_ON),
    ("executor", signal.SIGTERM): Rule(rest_s=6.0, ready_s=30.0, states=_CARRIES_ON),
    ("perception", signal.SIGKILL): Rule(rest_s=None, ready_s=50.0, states=_CARRIES_ON),
    ("perception", signal.SIGSTOP): Rule(rest_s=None, ready_s=60.0, states=_CARRIES_ON),
    ("perception", signal.SIGTERM): Rule(rest_s=None, ready_s=50.0, states=_CARRIES_ON),
    ("speech", signal.SIGKILL): Rule(rest_s=None, ready_s=30.0, states=_CARRIES_ON),
    ("speech", signal.SIGSTOP): Rule(rest_s=None, ready_s=40.0, states=_CARRIES_ON),
    ("speech", signal.SIGTERM): Rule(rest_s=None, ready_s=30.0, states=_CARRIES_ON),
    ("planner", signal.SIGKILL): Rule(rest_s=None, ready_s=30.0, states=_CARRIES_ON),
    ("planner", signal.SIGSTOP): Rule(rest_s=None, ready_s=40.0, states=_CARRIES_ON),
    ("planner", signal.SIGTERM): Rule(rest_s=None, ready_s=30.0, states=_CARRIES_ON),
    ("recorder", signal.SIGKILL): Rule(rest_s=None, ready_s=30.0, states=_CARRIES_ON),
    ("recorder", signal.SIGSTOP): Rule(rest_s=None, ready_s=40.0, states=_CARRIES_ON),
    ("recorder", signal.SIGTERM): Rule(rest_s=None, ready_s=30.0, states=_CARRIES_ON),
    ("dashboard", signal.SIGKILL): Rule(rest_s=None, ready_s=40.0, states=_CARRIES_ON),
    ("dashboard", signal.SIGSTOP): Rule(rest_s=None, ready_s=70.0, states=_CARRIES_ON),
    ("dashboard", signal.SIGTERM): Rule(rest_s=None, ready_s=40.0, states=_CARRIES_ON),
    ("supervisor", signal.SIGKILL): Rule(rest_s=4.0, ready_s=90.0, states=_WANTS_A_HAND),
    ("supervisor", signal.SIGSTOP): Rule(rest_s=6.0, ready_s=120.0, states=_WANTS_A_HAND),
    # An orderly end takes the power: the arms come down slowly, until they lie on something.
    ("supervisor", signal.SIGTERM): Rule(rest_s=15.0, ready_s=30.0, states=("silent",), ends=True),
}


@dataclass(frozen=True, slots=True, kw_only=True)
class Injection:
    """Name who gets which signal, how long after the command was given."""

    number: int
    process: str
    signal: signal.Signals
    after_s: float
    command: str

    @property
    def name(self) -> str:
        """Return the case in words."""
        return f"{self.number:03d}/{self.process}/{self.signal.name}@{self.after_s:.1f}s"


def injections(count: int, seed: int, latest_s: float = _LATEST_S) -> list[Injection]:
    """Return every pair of process and signal about equally often, in random order and time."""
    draw = random.Random(seed)
    pairs: list[tuple[str, signal.Signals]] = []
    while len(pairs) < count:
        round_of_all = list(RULES)
        draw.shuffle(round_of_all)
        pairs += round_of_all
    return [
        Injection(
            number=number,
            process=process,
            signal=what,
            after_s=draw.uniform(_EARLIEST_S, latest_s),
            command=_COMMANDS[number % len(_COMMANDS)],
        )
        for number, (process, what) in enumerate(pairs[:count])
    ]


class KillCampaign:
    """Own a machine and a robot, and do injections one after the other."""

    def __init__(self, folder: Path, seed: int, robot: str = "butler") -> None:
        self._clock = MonotonicClock()
        self._mover = ""
        self._hit_ns: dict[str, int] = {}
        self._machine = Machine(folder / "machine", self._clock, robot=robot, seed=seed)
        self._stillness = StillnessWatch()
        try:
            self._robot = RobotService(folder / "run", self._machine.devices_dir, self._clock)
        except BaseException:
            self._stillness.close()
            self._machine.close()
            raise

    def inject(self, injection: Injection) -> Case:
        """Do one and judge it."""
        self._stillness.worst_s()
        self._let_run_stably(injection.process)
        self._robot.make_ready()
        job = self._robot.begin("say", injection.command)
        self._clock.sleep_until(self._clock.now_ns() + round(injection.after_s * NS_PER_S))
        rule = RULES[injection.process, injection.signal]
        self._machine.begin_watch()
        began_ns = self._clock.now_ns()
        pid = self._robot.signal(injection.process, injection.signal)
        rest_s, ready_s = self._follow(began_ns, rule, injection.process, pid)
        self._clock.sleep_until(self._clock.now_ns() + round(_SETTLE_S * NS_PER_S))
        state = self._robot.control_state()
        failures = [
            *self._machine.hazards(),
            *late(rule.rest_s, rest_s, self._mover),
            *late_ready(rule.ready_s, ready_s),
        ]
        if state not in rule.states:
            why = self._robot.why()
            failures.append(wrong_state(state, why, rule.states))
        failures += [f"orphan {orphan}" for orphan in self._robot.orphans()]
        self._robot.end(job)
        self._hit_ns[injection.process] = self._clock.now_ns()
        return Case(
            name=injection.name,
            failures=tuple(failures),
            figures={"rest_s": rest_s, "ready_s": ready_s, "state": state},
            seconds=(self._clock.now_ns() - began_ns) / NS_PER_S,
        )

    def held_up_s(self) -> float:
        """Return for how long a core or the devices stood still, as those of a robot never do."""
        return max(self._machine.held_up_s(), self._stillness.worst_s())

    def close(self) -> None:
        """End the robot, then its machine."""
        try:
            self._robot.close()
        finally:
            self._stillness.close()
            self._machine.close()

    def _let_run_stably(self, process: str) -> None:
        """Hit a process only after a stable run: six failures in a row are another matter."""
        stable_ns = round(RestartPolicy().stable_s * NS_PER_S)
        if process in self._hit_ns:
            self._clock.sleep_until(self._hit_ns[process] + stable_ns)

    def _follow(self, began_ns: int, rule: Rule, process: str, pid: int) -> tuple[float, float]:
        """Return when everything began to rest for good, and when all was ready again."""
        rest_s, ready_s, since_s = math.inf, math.inf, 0.0
        least_s = 0.0 if rule.rest_s is None else rule.rest_s + _REST_FOR_S
        while since_s < max(least_s, rule.ready_s) and (since_s < least_s or math.isinf(ready_s)):
            since_s = (self._clock.now_ns() - began_ns) / NS_PER_S
            if since_s < least_s:
                joint, speed_rad_s = fastest_joint(self._machine.truth())
                if speed_rad_s > STANDSTILL_RAD_S:
                    rest_s, self._mover = math.inf, f"{joint} moves at {speed_rad_s:.2g} rad/s"
                else:
                    rest_s = min(rest_s, since_s)
            if math.isinf(ready_s) and self._is_back(rule, process, pid):
                ready_s = since_s
            self._clock.sleep_until(self._clock.now_ns() + round(_POLL_S * NS_PER_S))
        return (math.nan if rule.rest_s is None else rest_s), ready_s

    def _is_back(self, rule: Rule, process: str, pid: int) -> bool:
        if rule.ends:
            return self._robot.has_ended()
        return self._robot.is_ready() and self._robot.pid_of(process) not in (0, pid)


def run(options: argparse.Namespace, tell: Callable[[str], None]) -> Report:
    """Do `options.count` injections, 200 unless told otherwise."""
    drawn = injections(options.count or 200, options.seed)
    return inject_all(chosen(drawn, options.only, lambda each: each.name), options.seed, tell)


def inject_all(drawn: Sequence[Injection], seed: int, tell: Callable[[str], None]) -> Report:
    """Do injections one after the other on one machine."""
    with tempfile.TemporaryDirectory(prefix="vla-kill-") as folder:
        campaign = KillCampaign(Path(folder), seed)
        try:
            cases = [told(_tried(campaign, injection, tell), tell) for injection in drawn]
        finally:
            campaign.close()
    return Report(campaign="kills", cases=tuple(cases), summary=_summary(cases))


def _tried(campaign: KillCampaign, injection: Injection, tell: Callable[[str], None]) -> Case:
    """Do an injection, again where all that failed follows from a computer that stood still."""
    voids: list[str] = []
    while True:
        try:
            case = campaign.inject(injection)
        except NotReady as error:
            case = Case(name=injection.name, failures=(str(error),))
        case = replace(case, voids=tuple(voids))
        held_up_s = campaign.held_up_s()
        if len(voids) + 1 == _TRIES or not is_void(case.failures, held_up_s):
            return case
        voids.append(f"stood still for {held_up_s:.3f} s: {'; '.join(case.failures)}")
        tell(f"{case.row}\n  void: this computer {voids[-1]}; again")


def _summary(cases: Sequence[Case]) -> dict[str, Any]:
    """Return, for each process, its longest way to rest and back to ready."""
    summary: dict[str, Any] = {"unsafe": sum(bool(case.failures) for case in cases)}
    for process in sorted({process for process, _ in RULES}):
        mine = [case.figures for case in cases if case.figures and f"/{process}/" in case.name]
        rests = [each["rest_s"] for each in mine if not math.isnan(each["rest_s"])]
        summary[f"{process}_longest_rest_s"] = max(rests, default=math.nan)
        summary[f"{process}_longest_ready_s"] = max((each["ready_s"] for each in mine), default=0.0)
    return summary
