"""Take a bottle that stands between others from the side, in lock-step, and put it down again.

side_grasp   a cup, a ball and a phone stand and lie around it; physics says what the hand holds,
             what has fallen, and whether the bottle stands again
"""

import math
import random
import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

from drivers.clock import NS_PER_S, MonotonicClock
from sim_twin.campaigns.evidence import Watch, unwatched
from sim_twin.campaigns.report import CampaignCase
from sim_twin.harness.lockstep_stack import LockstepStack, armed_lockstep

SCENE: Final = "side_grasp"
BOTTLE: Final = "bottle"
PLACE: Final = "kitchen table"
NEIGHBOURS: Final = ("red_cup", "blue_ball", "phone")
TAKEN_AWAY: Final = ("blue_ball", "phone")
"""Before it is put down: a hand wants 0.1 m to each side of a spot, and all three leave none."""
BESIDE_M: Final = (0.12, 0.14)
"""From the bottle's middle: 40 to 60 mm between its side and that of the cup."""
TURNED_RAD: Final = 0.4
"""Cup and ball stand left and right of it, up to so far before or behind."""
BEHIND_M: Final = 0.14
REACHED_X_M: Final = (6.0, 6.6)
"""Where the table has room to both sides of it."""
FALLEN_RAD: Final = math.radians(20.0)
MOVED_M: Final = 0.05
"""A neighbour is out of its place."""
_ORIGINS_M: Final = {"red_cup": 0.5475, "blue_ball": 0.525, "phone": 0.506, BOTTLE: 0.59}
"""Heights of the things' origins on that table."""
_LIMIT_S: Final = 240.0
_ASKED_S: Final = 3.0
_SEEN_S: Final = 2.0
Objects = Mapping[str, Mapping[str, Any]]


def play(scene: str, seed: int, watch: Watch = unwatched) -> CampaignCase:
    """Play the scene with a seed."""
    clock, failures = MonotonicClock(), list[str]()
    begun_ns = clock.now_ns()
    with (
        tempfile.TemporaryDirectory(prefix="vla-") as folder,
        armed_lockstep(Path(folder), seed=seed) as stack,
    ):
        watch(stack)
        _set_up(stack, random.Random(seed))
        before = stack.lockstep.truth()["objects"]
        _do(stack, failures, "look_at", direction="down")
        _do(stack, failures, "pick_up", object=f"green {BOTTLE}", grasp="side")
        is_held = BOTTLE in stack.lockstep.truth()["held"]
        fallen = fallen_of(before, stack.lockstep.truth()["objects"])
        if is_held:
            for name in TAKEN_AWAY:
                stack.lockstep.twin.person.take(name)
            _do(stack, failures, "look_at", direction="down")
            stack.lockstep.run_for(_SEEN_S)
            _do(stack, failures, "place", destination=PLACE, relation="on")
            stack.lockstep.run_for(1.0)
        after = stack.lockstep.truth()
        fallen |= fallen_of(before, after["objects"]) - {*TAKEN_AWAY}
        is_put = is_held and BOTTLE not in after["held"] and _stands(after["objects"][BOTTLE])
    failures += [] if is_held else [f"the hand does not hold the {BOTTLE}"]
    failures += [f"{name} has fallen or was pushed away" for name in sorted(fallen)]
    failures += [f"the {BOTTLE} does not stand again"] if is_held and not is_put else []
    return CampaignCase(
        name=f"{scene}/{seed}",
        failures=tuple(failures),
        figures={"held": int(is_held), "fallen": len(fallen), "put_upright": int(is_put)},
        seconds=(clock.now_ns() - begun_ns) / NS_PER_S,
    )


def fallen_of(before: Objects, after: Objects) -> set[str]:
    """Return which of the neighbours lie now, or are elsewhere."""
    return {
        name
        for name in NEIGHBOURS
        if not _stands(after[name], is_ball=name == "blue_ball")
        or math.dist(before[name]["position_m"], after[name]["position_m"]) > MOVED_M
    }


def _stands(thing: Mapping[str, Any], *, is_ball: bool = False) -> bool:
    _, x, y, _ = thing["quaternion_wxyz"]
    return is_ball or 1.0 - 2.0 * (x * x + y * y) > math.cos(FALLEN_RAD)


def _set_up(stack: LockstepStack, draw: random.Random) -> None:
    """Put the neighbours around the bottle, and have the robot go there."""
    person = stack.lockstep.twin.person
    x_m, y_m, _ = stack.lockstep.truth()["objects"][BOTTLE]["position_m"]
    x_m = min(max(x_m, REACHED_X_M[0]), REACHED_X_M[1])
    turned_rad = draw.uniform(-TURNED_RAD, TURNED_RAD)
    cup_m, ball_m = draw.uniform(*BESIDE_M), -draw.uniform(*BESIDE_M)
    cosine, sine = math.cos(turned_rad), math.sin(turned_rad)
    for name in NEIGHBOURS:
        person.take(name)
    for name, dx_m, dy_m in (
        (BOTTLE, 0.0, 0.0),
        ("red_cup", cup_m * cosine, cup_m * sine),
        ("blue_ball", ball_m * cosine, ball_m * sine),
        ("phone", 0.0, BEHIND_M),
    ):
        spot = {"x_m": x_m + dx_m, "y_m": y_m + dy_m, "z_m": _ORIGINS_M[name], "yaw_rad": 0.0}
        person.put(name, spot)
    stack.say(f"go to the {PLACE}")


def _do(stack: LockstepStack, failures: list[str], skill: str, **parameters: Any) -> None:
    """Have one action done, with a yes where the robot asks; note why it failed."""
    action: dict[str, Any] = {"skill": skill, "parameters": parameters}
    command_id = stack.give(plan={"goal": skill, "actions": [action]})
    asked_before = _questions(stack)
    if not stack.wait_until(lambda: stack.outcome(command_id) is not None, _ASKED_S):
        if _questions(stack) > asked_before:
            stack.give(text="yes", answer=True)
        stack.wait_until(lambda: stack.outcome(command_id) is not None, _LIMIT_S)
    outcome = stack.outcome(command_id) or {"error": "no end in time"}
    if not outcome.get("success"):
        failures.append(f"{skill}: {outcome.get('error') or outcome.get('reason')}")


def _questions(stack: LockstepStack) -> int:
    return sum(event["event"] == "asked" for event in stack.events)
