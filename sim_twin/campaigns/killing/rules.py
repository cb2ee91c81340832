"""Declare what must follow from the end of each process, and draw who is ended when."""

import random
import signal
from collections import Counter
from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass, replace
from enum import Enum
from typing import Final

from sim_twin.physics.truth import STANDSTILL_RAD_S
from vla_deploy.robots import RobotDescription
from vla_deploy.supervisor.table import UNWATCHED_WHEELS_S

_Pair = tuple[str, signal.Signals]
SIGNALS: Final = (signal.SIGKILL, signal.SIGSTOP, signal.SIGTERM)
_EARLIEST_S, _LATEST_S = 0.5, 10.0
"""A job takes 20 to 40 seconds, and goes on through most kills."""


@dataclass(frozen=True, slots=True, kw_only=True)
class KillRule:
    """Declare what must follow from the end of a process.

    `rest_s` is until when everything rests, None where the robot may carry on; `ready_s` until when
    all processes are ready again without a hand; `states` are those in which control then may be.
    Where it `ends`, a person has asked for it: `ready_s` is until when the service has ended.
    What moves no faster than `rest_rad_s` rests.
    """

    rest_s: float | None
    ready_s: float
    states: tuple[str, ...]
    ends: bool = False
    rest_rad_s: float = STANDSTILL_RAD_S

    @property
    def stays(self) -> bool:
        """Return whether nothing may move from the rest to a hand's act; lowered arms lie limp."""
        return self.rest_s is not None and self.states == _WANTS_A_HAND

    def judge(self, ready_s: float, state: str, why: str) -> Iterator[str]:
        """Return what was wrong with when all was ready again, and where control then is."""
        if not ready_s <= self.ready_s:
            yield f"ready after {ready_s:.1f} s, limit {self.ready_s:g} s"
        if state not in self.states:
            yield f"control is {state} ({why}), expected {' or '.join(self.states)}"


_CARRIES_ON: Final = ("armed",)
_WANTS_A_HAND: Final = ("disarmed", "stopped", "fault")
# A frozen process is noticed by its silence, so it takes its row's limit longer than a dead one.
RULES: Final[Mapping[tuple[str, signal.Signals], KillRule]] = {
    ("control", signal.SIGKILL): KillRule(rest_s=1.5, ready_s=30.0, states=_WANTS_A_HAND),
    ("control", signal.SIGSTOP): KillRule(rest_s=1.5, ready_s=40.0, states=_WANTS_A_HAND),
    ("control", signal.SIGTERM): KillRule(rest_s=4.0, ready_s=30.0, states=_WANTS_A_HAND),
    ("stop_door", signal.SIGKILL): KillRule(rest_s=None, ready_s=30.0, states=_CARRIES_ON),
    ("stop_door", signal.SIGSTOP): KillRule(rest_s=None, ready_s=40.0, states=_CARRIES_ON),
    ("stop_door", signal.SIGTERM): KillRule(rest_s=None, ready_s=30.0, states=_CARRIES_ON),
    ("executor", signal.SIGKILL): KillRule(rest_s=6.0, ready_s=30.0, states=_CARRIES_ON),
    ("executor", signal.SIGSTOP): KillRule(rest_s=6.0, ready_s=40.0, states=_CARRIES_ON),
    ("executor", signal.SIGTERM): KillRule(rest_s=6.0, ready_s=30.0, states=_CARRIES_ON),
    ("perception", signal.SIGKILL): KillRule(rest_s=None, ready_s=50.0, states=_CARRIES_ON),
    ("perception", signal.SIGSTOP): KillRule(rest_s=None, ready_s=60.0, states=_CARRIES_ON),
    ("perception", signal.SIGTERM): KillRule(rest_s=None, ready_s=50.0, states=_CARRIES_ON),
    ("speech", signal.SIGKILL): KillRule(rest_s=None, ready_s=30.0, states=_CARRIES_ON),
    ("speech", signal.SIGSTOP): KillRule(rest_s=None, ready_s=40.0, states=_CARRIES_ON),
    ("speech", signal.SIGTERM): KillRule(rest_s=None, ready_s=30.0, states=_CARRIES_ON),
    ("planner", signal.SIGKILL): KillRule(rest_s=None, ready_s=30.0, states=_CARRIES_ON),
    ("planner", signal.SIGSTOP): KillRule(rest_s=None, ready_s=40.0, states=_CARRIES_ON),
    ("planner", signal.SIGTERM): KillRule(rest_s=None, ready_s=30.0, states=_CARRIES_ON),
    ("recorder", signal.SIGKILL): KillRule(rest_s=None, ready_s=30.0, states=_CARRIES_ON),
    ("recorder", signal.SIGSTOP): KillRule(rest_s=None, ready_s=40.0, states=_CARRIES_ON),
    ("recorder", signal.SIGTERM): KillRule(rest_s=None, ready_s=30.0, states=_CARRIES_ON),
    ("dashboard", signal.SIGKILL): KillRule(rest_s=None, ready_s=40.0, states=_CARRIES_ON),
    ("dashboard", signal.SIGSTOP): KillRule(rest_s=None, ready_s=70.0, states=_CARRIES_ON),
    ("dashboard", signal.SIGTERM): KillRule(rest_s=None, ready_s=40.0, states=_CARRIES_ON),
    ("supervisor", signal.SIGKILL): KillRule(rest_s=4.0, ready_s=90.0, states=_WANTS_A_HAND),
    ("supervisor", signal.SIGSTOP): KillRule(rest_s=6.0, ready_s=120.0, states=_WANTS_A_HAND),
    # An orderly end takes the power: the arms come down slowly, until they lie on something. A limp
    # one that slides on there is braked by its own motors alone: 3 cm/s at a hand counts as rest.
    ("supervisor", signal.SIGTERM): KillRule(
        rest_s=15.0, ready_s=30.0, states=("silent",), ends=True, rest_rad_s=0.05
    ),
}


def rule_of(robot: RobotDescription, injection: "Injection") -> KillRule:
    """Return the rule; wheels without a watchdog turn until a hung control is ended and anew."""
    case = (injection.process, injection.signal)
    rule = RULES[case]
    if not robot.servo_bus.wheels or case != ("control", signal.SIGSTOP):
        return rule
    return replace(rule, rest_s=UNWATCHED_WHEELS_S + (rule.rest_s or 0.0))


GRAVEST: Final = (
    ("control", signal.SIGKILL),
    ("control", signal.SIGSTOP),
    ("control", signal.SIGTERM),
    ("supervisor", signal.SIGKILL),
)
"""Every round has these, however short it is."""
WITH_A_FULL_HAND: Final = (GRAVEST[0], GRAVEST[-1])
"""In a short round these alone wait for one."""


class KillMoment(Enum):
    """Name what the robot should be doing when the signal comes."""

    MOVING = "moving"
    CARRYING = "carrying"


@dataclass(frozen=True, slots=True, kw_only=True)
class Injection:
    """Name who gets which signal, and how long after the robot was ready.

    It then waits a while for the moment. A command that still goes on is not given again.
    """

    number: int
    process: str
    signal: signal.Signals
    after_s: float
    moment: KillMoment = KillMoment.MOVING

    @property
    def name(self) -> str:
        """Return the case in words."""
        return f"{self.number:03d}/{self.process}/{self.signal.name}@{self.after_s:.1f}s"


def injections(
    count: int, seed: int, latest_s: float = _LATEST_S, without: Collection[str] = ()
) -> list[Injection]:
    """Return every pair of process and signal about equally often, in random order and time.

    Where there are fewer than there are pairs, the gravest are among them, while carrying. The
    robot runs `without` some processes.
    """
    draw = random.Random(seed)
    pairs: list[_Pair] = []
    while len(pairs) < count:
        pairs += _round(draw, count - len(pairs), without)
    short = count < len(RULES)
    return [
        Injection(
            number=number,
            process=process,
            signal=what,
            after_s=draw.uniform(_EARLIEST_S, latest_s),
            moment=KillMoment.CARRYING
            if short and (process, what) in WITH_A_FULL_HAND
            else KillMoment.MOVING,
        )
        for number, (process, what) in enumerate(pairs)
    ]


def _round(draw: random.Random, most: int, without: Collection[str]) -> list[_Pair]:
    """Return every pair once, or `most` of them with the gravest, in random order."""
    pairs = [pair for pair in RULES if pair[0] not in without]
    draw.shuffle(pairs)
    chosen = sorted(pairs, key=lambda pair: pair not in GRAVEST)[:most]
    draw.shuffle(chosen)
    return _spread(chosen)


def _spread(pairs: list[_Pair]) -> list[_Pair]:
    """Let others come between two ends of a process: it has to run stably before the next."""
    before: Counter[str] = Counter()
    turns: list[tuple[int, _Pair]] = []
    for pair in pairs:
        turns.append((before[pair[0]], pair))
        before[pair[0]] += 1
    return [pair for _, pair in sorted(turns, key=lambda turn: turn[0])]
