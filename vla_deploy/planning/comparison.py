"""Compare what two plans move: which things, to where, and where the robot goes.

Two back ends say the same in other steps: one looks for a thing that is in sight, the other drives
to it. What leads up to taking and putting a thing is left out, and so is what moves nothing.
"""

from collections.abc import Iterator
from typing import Any, Final

from vla_deploy.planning.interfaces import PlanRequest
from vla_deploy.plans.catalogue import MOTIONLESS
from vla_deploy.plans.knowledge import match_place
from vla_deploy.plans.plan import Action, Plan, execution_order
from vla_deploy.plans.symbolic.simulation import end_state
from vla_deploy.plans.symbolic.state import subject_of

_HANDLING: Final = frozenset({"pick_up", "place"})
_LEADING_UP: Final = frozenset({"find_object", "navigate_to"})
_NOT_COMPARED: Final = frozenset({*MOTIONLESS, "look_at"})
# Digits of metres and radians that are compared.
_DIGITS: Final = 1
# Who goes to the charging station goes to charge.
_ALIKE: Final = {"charge": "navigate_to"}
# How a way is driven; which hand gives shows in what the hands hold then.
_HOW: Final = frozenset(
    {("navigate_to", "yaw_rad"), ("navigate_to", "speed_m_s"), ("move", "speed_m_s"),
     ("hand_over", "arm")}
)  # fmt: skip


def move_the_same(one: Plan, other: Plan, request: PlanRequest) -> bool:
    """Return whether two plans move the same things to the same places, and the robot alike.

    Both must have been grounded and checked in the world of the request.
    """
    return _effects(one, request) == _effects(other, request)


def _effects(plan: Plan, request: PlanRequest) -> tuple[object, ...]:
    """Return what a hand takes, where that rests and what is held in the end, and all else done."""
    actions = execution_order(plan.actions)
    state = end_state(actions, request.world, request.scene, request.here)
    taken = (one.parameters["object"] for one in actions if one.skill == "pick_up")
    return (
        {subject_of(str(name), request.scene).key for name in taken},
        dict(state.rests),
        {held.key for held in state.held},
        list(_ways(actions, request)),
    )


def _ways(actions: list[Action], request: PlanRequest) -> Iterator[str]:
    """Yield what is done besides handling things and what leads up to that."""
    compared = [one for one in actions if one.skill not in _NOT_COMPARED]
    for number, action in enumerate(compared):
        if action.skill in _HANDLING:
            continue
        following = (one.skill for one in compared[number:] if one.skill not in _LEADING_UP)
        if action.skill in _LEADING_UP and next(following, "") in _HANDLING:
            continue
        yield " ".join([_ALIKE.get(action.skill, action.skill), *_values(action, request)])


def _values(action: Action, request: PlanRequest) -> Iterator[str]:
    for name, value in sorted(action.parameters.items()):
        if value is not None and (action.skill, name) not in _HOW:
            yield f"{name}={_value(name, value, request)}"


def _value(name: str, value: Any, request: PlanRequest) -> str:
    if isinstance(value, int | float):
        return f"{float(value):.{_DIGITS}f}"
    if name == "object":
        return subject_of(str(value), request.scene).key
    return match_place(str(value), request.world.places) or str(value)
