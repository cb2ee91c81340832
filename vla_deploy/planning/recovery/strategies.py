"""Mend what is left of a plan, one idea each; the first whose plan may run is taken.

A strategy returns the actions to go on with, in order, or none where it has nothing to offer. What
is missing between them, such as driving there, grounding puts in; the validator judges the result.
"""

from collections.abc import Callable, Mapping
from typing import Final

from vla_deploy.planning.errors import CannotBeDone
from vla_deploy.planning.interfaces import Check, PlanningResult, PlanRequest, Proposal
from vla_deploy.planning.recovery.setback import Carried
from vla_deploy.plans.errors import PlanError
from vla_deploy.plans.knowledge import object_or_none
from vla_deploy.plans.plan import Action, FailureCause
from vla_deploy.plans.symbolic.state import state_of, subject_of

RECOVERY: Final = "recovery"
BLOCKED_BY_OTHERS: Final = frozenset({"navigate_to", "charge", "move", "turn"})
WAIT_S: Final = 5.0
OBJECT_PARAMETERS: Final = ("object", "destination")
_CONFIDENCE: Final = 0.8
_UNCLEAR: Final = "nobody knows how much of the way was done"
Steps = list[Action]
Strategy = Callable[[Carried, PlanRequest], Steps]


def recover(carried: Carried, request: PlanRequest, check: Check) -> PlanningResult:
    """Return a plan that mends the last setback, or why none of the strategies has one.

    The proposal's `origin` names the strategy. Where it is not known how much of a drive or a turn
    was done, none is tried: it would be done again.
    """
    error = carried.setbacks[-1].error
    if not carried.setbacks[-1].is_clear:
        return PlanningResult(error=CannotBeDone(f"{error} ({_UNCLEAR})"))
    refusals = []
    for name, strategy in STRATEGIES.items():
        steps = [] if carried.tried(name) else strategy(carried, request)
        if not steps:
            continue
        in_turn = {"actions": _in_turn(steps), "reasoning": f"after a failure: {name}"}
        plan = carried.plan.model_copy(update={**in_turn, "feasible": True})
        proposal = Proposal(plan=plan, back_end=RECOVERY, confidence=_CONFIDENCE, origin=name)
        try:
            return PlanningResult(plan=check(plan, request), proposal=proposal)
        except PlanError as refused:
            refusals.append(f"{name}: {refused}")
    why = "; ".join(refusals) or "nothing else is left to try"
    return PlanningResult(error=CannotBeDone(f"{error} ({why})"))


def put_in(carried: Carried, _: PlanRequest) -> Steps:
    """Do what is left, with what the world has turned out to lack put in before it."""
    return [] if carried.setbacks[-1].cause is FailureCause.SKILL else carried.left


def take_again(carried: Carried, request: PlanRequest) -> Steps:
    """Take once more what the hands have lost on the way."""
    if carried.failed.skill != "place":
        return []
    state = state_of(request.world, request.scene, request.here)
    held = {one.key for one in state.held}
    lost = []
    for action in carried.setbacks[-1].done:
        if action.skill == "pick_up":
            # Where it was not seen which one was taken, a thing of its kind is held.
            subject = subject_of(str(action.parameters["object"]), request.scene)
            lost += [action] if held.isdisjoint((subject.key, subject.kind)) else []
    return [_looked_for(lost[-1]), lost[-1], *carried.left] if state.hands and lost else []


def look_again(carried: Carried, _: PlanRequest) -> Steps:
    """Look for the thing anew, and try once more from where it is seen then."""
    failed = carried.failed
    if failed.skill == "find_object" or _object_of(failed) is None:
        return []
    return [_looked_for(failed), *carried.left]


def wait(carried: Carried, _: PlanRequest) -> Steps:
    """Give a person who stands in the way time to go, and try once more."""
    failed = carried.failed
    if failed.skill not in BLOCKED_BY_OTHERS:
        return []
    pause = Action(id=f"{failed.id[:40]}_wait", skill="wait", parameters={"duration_s": WAIT_S})
    return [pause, *carried.left]


def other_hand(carried: Carried, request: PlanRequest) -> Steps:
    """Take with the other hand, and put down with it."""
    hands, used = tuple(request.world.holding), carried.failed.parameters.get("arm")
    if carried.failed.skill != "pick_up" or used not in hands or len(hands) != 2:
        return []
    other = next(hand for hand in hands if hand != used)
    return [
        one.model_copy(update={"parameters": {**one.parameters, "arm": other}})
        if one.parameters.get("arm") == used
        else one
        for one in carried.left
    ]


STRATEGIES: Final[Mapping[str, Strategy]] = {
    "put in": put_in,
    "take again": take_again,
    "look again": look_again,
    "wait": wait,
    "other hand": other_hand,
}


def _object_of(action: Action) -> str | None:
    """Return the thing that an action is about; None where it is about a place, or nothing."""
    for key in OBJECT_PARAMETERS:
        name = action.parameters.get(key)
        if object_or_none(name) is not None:
            return str(name)
    return None


def _looked_for(action: Action) -> Action:
    name = _object_of(action)
    return Action(id=f"{action.id[:40]}_again", skill="find_object", parameters={"object": name})


def _in_turn(steps: Steps) -> tuple[Action, ...]:
    """Return the actions with each waiting for the one before it."""
    needed = [(), *((one.id,) for one in steps)]
    return tuple(
        one.model_copy(update={"depends_on": before, "after": ()})
        for one, before in zip(steps, needed, strict=False)
    )
