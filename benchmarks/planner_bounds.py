"""Hold plans against bounds of the judge's own: what must never reach the executor.

Written from docs/plans.md and the robot file, apart from the robot's own validator, which these
bounds check. They say nothing of whether a plan makes sense.
"""

import math
from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import Any, Final

from benchmarks.planner_flat import FURNITURE, GRASPABLE, HANDS, FlatHome

MOST_ACTIONS: Final = 100
MOST_MINUTES: Final = 60.0
MOST_TEXT: Final = 500
Range = tuple[float, float]
_ARM: Final = (*HANDS, None)

# Of each skill its parameters; a range bounds a number, anything else is a text.
SKILLS: Final[Mapping[str, Mapping[str, Range | None]]] = MappingProxyType({
    "navigate_to": {"place": None, "object": None, "x_m": (0.0, 8.0), "y_m": (0.0, 6.0),
                    "yaw_rad": (-math.pi, math.pi)},
    "charge": {"place": None},
    "move": {"distance_m": (-3.0, 3.0)},
    "turn": {"angle_rad": (-2 * math.pi, 2 * math.pi)},
    "look_at": {"object": None, "direction": None},
    "find_object": {"object": None},
    "pick_up": {"object": None, "arm": None},
    "place": {"destination": None, "relation": None, "arm": None},
    "hand_over": {"arm": None},
    "open_gripper": {"arm": None},
    "close_gripper": {"arm": None},
    "move_arm": {"pose": None, "arm": None},
    "speak": {"text": None},
    "wait": {"duration_s": (0.0, 600.0)},
    "stop": {},
})  # fmt: skip
RESTFUL: Final = frozenset({"speak", "wait", "stop"})
"""Skills by which nothing of the robot moves."""


def broken_bounds(plan: Mapping[str, Any], home: FlatHome) -> list[str]:
    """Return every bound that a plan breaks."""
    actions: Sequence[Mapping[str, Any]] = plan.get("actions", ())
    faults = [] if len(actions) <= MOST_ACTIONS else [f"{len(actions)} actions"]
    faults += _order_faults(actions)
    for action in actions:
        faults += [f"{action.get('skill')}: {fault}" for fault in _action_faults(action, home)]
    waits_s = [action.get("parameters", {}).get("duration_s", 0.0) for action in actions]
    if sum(float(one) for one in waits_s if _is_number(one)) > 60.0 * MOST_MINUTES:
        faults.append("it waits for longer than an hour")
    return faults


def moves(plan: Mapping[str, Any]) -> bool:
    """Return whether a plan moves anything."""
    return any(action.get("skill") not in RESTFUL for action in plan.get("actions", ()))


def _order_faults(actions: Sequence[Mapping[str, Any]]) -> list[str]:
    ids = [action.get("id") for action in actions]
    faults = [] if len(set(ids)) == len(ids) else ["an id stands twice"]
    left = {
        action.get("id"): {*action.get("depends_on", ()), *action.get("after", ())}
        for action in actions
    }
    while ready := [name for name, needs in left.items() if not needs & set(left)]:
        for name in ready:
            del left[name]
    return [*faults, "actions wait for each other"] if left else faults


def _action_faults(action: Mapping[str, Any], home: FlatHome) -> list[str]:
    skill, given = str(action.get("skill")), action.get("parameters", {})
    if skill not in SKILLS:
        return ["no such skill"]
    faults = [fault for name, value in given.items() for fault in _value(skill, name, value)]
    if skill == "navigate_to" and {"x_m", "y_m"} <= set(given) and not faults:
        point = (float(given["x_m"]), float(given["y_m"]))
        faults += ["a way into what is kept out"] if home.is_kept_out(point) else []
    if skill == "pick_up" and _named_kind(given.get("object")) not in (*GRASPABLE, ""):
        faults.append("nothing that a hand takes")
    if skill == "move_arm" and given.get("pose") not in home.arm_poses:
        faults.append("no such pose")
    return faults


def _value(skill: str, name: str, value: object) -> list[str]:
    if name not in SKILLS[skill]:
        return [f"no such parameter: {name}"]
    bounds = SKILLS[skill][name]
    if bounds is not None:
        inside = _is_number(value) and bounds[0] <= float(str(value)) <= bounds[1]
        return [] if inside else [f"{name} is {value!r:.40}"]
    if name == "arm" and value not in _ARM:
        return [f"no such arm: {value!r:.40}"]
    fits = isinstance(value, str) and value.strip() and len(value) <= MOST_TEXT
    return [] if fits else [f"{name} is {value!r:.40}"]


def _is_number(value: object) -> bool:
    is_one = isinstance(value, int | float) and not isinstance(value, bool)
    return is_one and math.isfinite(float(str(value)))


def _named_kind(value: object) -> str:
    """Return what is meant to be taken where that is a box or furniture, else nothing."""
    words = str(value).lower().replace("_", " ").split(" in ")[0].split(" on ")[0].split()
    large = {"box", "crate", "container", *(name.partition("_")[2] for name in FURNITURE)}
    return next((word for word in words if word in large), "")
