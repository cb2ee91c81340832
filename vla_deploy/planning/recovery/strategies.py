"""Mend what is left of a plan, one idea each; none of them judges whether the result may run.

A strategy returns the actions to go on with, or None where it has none to offer. What is missing
between them, such as driving there, grounding puts in; whether they may run, the validator says.
"""

import re
from collections.abc import Callable, Mapping
from typing import Any, Final

from vla_deploy.planning.errors import UnknownObject
from vla_deploy.planning.interfaces import Request
from vla_deploy.planning.plan import Action, execution_order
from vla_deploy.planning.recovery.setback import Carried, Cause
from vla_deploy.planning.references import parse_object
from vla_deploy.planning.symbolic.state import State, state_of
from vla_deploy.planning.symbolic.subjects import Subject, subject_of

Steps = tuple[Action, ...]
Strategy = Callable[[Carried, Request], Steps | None]
# What a command is about does not depend on these.
INESSENTIAL: Final = frozenset({"look_at", "speak", "wait"})
BLOCKED_BY_OTHERS: Final = frozenset({"navigate_to", "move", "turn"})
WAIT_S: Final = 5.0
OBJECT_PARAMETERS: Final = ("object", "destination")
_ANY: Final = r"\b(?:a|an|any|some|one)\s+(?:\w+\s+){0,2}"


def put_in(carried: Carried, request: Request) -> Steps | None:
    """Do what is left, with what the world has turned out to lack put in before it."""
    del request
    return None if carried.setbacks[-1].cause is Cause.SKILL else carried.left


def skip(carried: Carried, request: Request) -> Steps | None:
    """Go on without an action that nothing depends on."""
    del request
    failed = carried.setbacks[-1].action
    if failed.skill not in INESSENTIAL:
        return None
    rest = tuple(
        action.model_copy(update={"depends_on": _replaced(action, failed)})
        for action in carried.left
        if action.id != failed.id
    )
    return rest or None


def take_again(carried: Carried, request: Request) -> Steps | None:
    """Take once more what the hands have lost on the way."""
    if carried.setbacks[-1].action.skill != "place":
        return None
    state = state_of(request.world, request.scene, request.here)
    done = carried.setbacks[-1].done_ids
    taken = [one for one in execution_order(carried.plan.actions) if one.skill == "pick_up"]
    lost = [one for one in taken if one.id in done and not _is_held(one, state, request)]
    if not state.hands or not lost:
        return None
    again = lost[-1].model_copy(update={"depends_on": ()})
    return _behind(_looked_for(again), _behind(again, carried.left))


def look_again(carried: Carried, request: Request) -> Steps | None:
    """Look for the thing anew, and try once more from where it is seen then."""
    del request
    failed = carried.setbacks[-1].action
    if failed.skill == "find_object" or _object_of(failed) is None:
        return None
    return _behind(_looked_for(failed), carried.left)


def wait(carried: Carried, request: Request) -> Steps | None:
    """Give whoever stands in the way time to go, and try once more."""
    del request
    failed = carried.setbacks[-1].action
    if failed.skill not in BLOCKED_BY_OTHERS:
        return None
    pause = Action(id=f"{failed.id[:40]}_wait", skill="wait", parameters={"duration_s": WAIT_S})
    return _behind(pause, carried.left)


def other_hand(carried: Carried, request: Request) -> Steps | None:
    """Take with the other hand, and put down with it."""
    failed = carried.setbacks[-1].action
    hands, used = tuple(request.world.holding), failed.parameters.get("arm")
    if failed.skill != "pick_up" or used not in hands or len(hands) != 2:
        return None
    other = next(hand for hand in hands if hand != used)
    return tuple(
        _with(action, {"arm": other}) if action.parameters.get("arm") == used else action
        for action in carried.left
    )


def other_thing(carried: Carried, request: Request) -> Steps | None:
    """Take another thing of the same kind and colour, where any was asked for."""
    failed = carried.setbacks[-1].action
    name = _object_of(failed)
    if name is None or request.scene is None:
        return None
    subject = subject_of(name, request.scene)
    other = _other_like(subject, request)
    if other is None or not re.search(_ANY + re.escape(subject.kind), request.text.lower()):
        return None
    return tuple(
        _with(
            action, {key: other for key in OBJECT_PARAMETERS if action.parameters.get(key) == name}
        )
        for action in carried.left
    )


STRATEGIES: Final[Mapping[str, Strategy]] = {
    "skip": skip,
    "put in": put_in,
    "take again": take_again,
    "look again": look_again,
    "wait": wait,
    "other hand": other_hand,
    "other thing": other_thing,
}


def _other_like(subject: Subject, request: Request) -> str | None:
    scene, colour = request.scene, subject.thing.colour if subject.thing is not None else ""
    if scene is None:
        return None
    return next(
        (
            one.thing_id
            for one in scene.things
            if one.kind == subject.kind
            and one.thing_id != subject.key
            and colour in ("", one.colour)
            and not one.held_by
        ),
        None,
    )


def _object_of(action: Action) -> str | None:
    """Return the thing that an action is about; None where it is about a place, or nothing."""
    for key in OBJECT_PARAMETERS:
        name = action.parameters.get(key)
        try:
            parse_object(str(name))
        except UnknownObject:
            continue
        return str(name)
    return None


def _is_held(taken: Action, state: State, request: Request) -> bool:
    """Tell whether a hand holds what was taken; where nobody saw which one, a thing of its kind."""
    subject = subject_of(str(taken.parameters["object"]), request.scene)
    return any(one.key in (subject.key, subject.kind) for one in state.held)


def _looked_for(action: Action) -> Action:
    name = _object_of(action)
    return Action(id=f"{action.id[:40]}_again", skill="find_object", parameters={"object": name})


def _behind(first: Action, rest: Steps) -> Steps:
    """Return the first and all others, which wait for it."""
    after = {"depends_on": (first.id,)}
    return (first, *(one if one.depends_on else one.model_copy(update=after) for one in rest))


def _with(action: Action, changes: Mapping[str, Any]) -> Action:
    return action.model_copy(update={"parameters": {**action.parameters, **changes}})


def _replaced(action: Action, gone: Action) -> tuple[str, ...]:
    """Return what an action waits for, with what a skipped one waited for in its place."""
    needed = [
        name
        for one in action.depends_on
        for name in ((one,) if one != gone.id else gone.depends_on)
    ]
    return tuple(dict.fromkeys(needed))
