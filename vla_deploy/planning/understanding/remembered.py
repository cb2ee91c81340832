"""Use what is remembered of earlier commands, for the plans of every back end alike.

Patterns and the command parser know nothing of the past, and language models may overlook it. So
it is used where all plans pass: where a thing that is not in sight is looked for first, and with
which hand a thing is taken.
"""

from collections.abc import Mapping, Sequence
from typing import Any, Final

from vla_deploy.planning.interfaces import Forbidden, PlanRequest
from vla_deploy.plans.knowledge import match_place, object_or_none
from vla_deploy.plans.plan import Action
from vla_deploy.plans.symbolic.conditions import MET, Setting, is_known
from vla_deploy.plans.symbolic.state import SymbolicState

# What is done with a thing that must be found first.
_OF_UNSEEN: Final = frozenset({"find_object", "look_at", "inspect", "navigate_to", "pick_up"})


def place_to_look(
    step: Action, state: SymbolicState, done: Sequence[Action], request: PlanRequest
) -> str:
    """Return where to go before a thing is looked for that was seen there once, "" for nowhere.

    Whoever has made the plan knows better where it says where to go, and so do plans after a
    failure, and a scene from which the thing has gone.
    """
    if step.skill not in _OF_UNSEEN or request.scene is None or request.failed:
        return ""
    query = object_or_none(step.parameters.get("object"))
    if query is None or any("place" in one.parameters for one in done):
        return ""
    setting = Setting(parameters=step.parameters, world=request.world, scene=request.scene)
    subject = setting.subject("object")
    if subject is None or subject.thing is not None or subject.others:
        return ""
    if is_known(state, setting) == MET or any(query.fits(one.thing) for one in request.scene.lost):
        return ""
    seen = request.experience.where(query.kind, query.colour)
    place = "" if seen is None else _known_place(seen.place, request)
    return "" if not place or request.experience.is_blocked(place) else place


def hand_to_take(given: Mapping[str, Any], state: SymbolicState, request: PlanRequest) -> str:
    """Return the free hand to take a thing with, "" for any.

    It is the other one than could not take such a thing the last time.
    """
    query = object_or_none(given.get("object"))
    if query is None or "arm" in given or request.failed:
        return ""
    failed = request.experience.failed_hand(query.kind)
    if failed not in state.hands:
        return ""
    free = [hand for hand in state.hands if not state.holding(hand)]
    return next((hand for hand in free if hand != failed), "") if failed in free else ""


def _known_place(place: str, request: PlanRequest) -> str:
    """Return the place that a memory names, "" for hands and what is forbidden."""
    words = place.removeprefix("floor ").removeprefix("near ")
    found = match_place(words, request.world.places) or ""
    closed = [one.words for one in request.prohibitions if one.what is Forbidden.PLACE]
    is_closed = any(found in request.world.surfaces_of(one) for one in closed)
    return "" if is_closed else found
