"""Resolve where something shall go: onto or into a thing, to a place, "here" or "there"."""

import math
from collections.abc import Callable, Mapping
from typing import Any, Final

from vla_deploy.planning.errors import NotAble, UnknownObject, UnknownPlace
from vla_deploy.planning.references import match_place, words_of
from vla_deploy.planning.symbolic.conditions import PUT_INTO
from vla_deploy.planning.symbolic.state import State
from vla_deploy.planning.symbolic.subjects import subject_of
from vla_deploy.planning.understanding import phrases
from vla_deploy.planning.understanding.conversation import Mention, Role
from vla_deploy.planning.understanding.expressions import read_expression
from vla_deploy.planning.understanding.fitting import Use
from vla_deploy.planning.understanding.insertions import is_surface, nearest_furniture, surface_of
from vla_deploy.planning.understanding.places import is_like_place, resolve_place
from vla_deploy.planning.understanding.referents import Referent
from vla_deploy.planning.understanding.resolver import Resolver
from vla_deploy.world.relations import NEXT_TO
from vla_deploy.world.resting import IN

Parameters = Mapping[str, Any]
GetState = Callable[[], State]
# So near to where one stands for a table, that table is "here".
HERE_M: Final = 1.2


def destination_of(given: Parameters, resolver: Resolver, state: GetState) -> Parameters:
    """Return where to put it and how; without a word about it, on the nearest furniture.

    Raises:
        PlanningError: where that is, is not known, or must be asked.
    """
    text = given.get("destination")
    if text is not None and not isinstance(text, str):
        return {}
    relation = given.get("relation")
    if text is None or pronoun_of(text) == phrases.HERE:
        return _put_here(text or "down", resolver, state())
    thing = thing_unless_place(text, resolver, Use.ONTO, into=relation == "in")
    if thing is not None:
        if relation == NEXT_TO and (container := _container_of(thing, resolver)):
            resolver.referents.note(text, Role.DESTINATION, container, "that is what it is in")
            return {"destination": container, "relation": IN}
        default = "in" if thing.kind in PUT_INTO else "on"
        return {"destination": thing.name, "relation": relation or default}
    if relation == NEXT_TO:
        raise NotAble(f"I put things next to things and on furniture, not next to {text}")
    world = resolver.setting.request.world
    place = resolve_place(text, resolver)
    surface = surface_of(place, world)
    if surface != place:
        resolver.referents.note(place, Role.DESTINATION, surface, "the furniture there")
    return {"destination": surface, "relation": "on"}


def check_readable(text: Any, resolver: Resolver) -> None:
    """Refuse an unknown destination before asking which thing shall go there.

    Raises:
        UnknownObject: it names nothing known.
    """
    if not isinstance(text, str) or pronoun_of(text):
        return
    if not is_like_place(text, resolver.setting.request.world.places):
        read_expression(text, resolver.setting.furniture)


def thing_unless_place(
    text: str, resolver: Resolver, use: Use, *, into: bool = False
) -> Referent | None:
    """Return the thing that a text names, None where it names a place by its name or no thing.

    Raises:
        UnknownObject: it is to take something, and names nothing known.
        NotThere: things are known, but none that it can mean.
        Ambiguous: only the speaker can tell.
    """
    if match_place(text, resolver.setting.request.world.places):
        return None
    if pronoun_of(text) == phrases.THERE:
        latest = _spoken_there(resolver, use, into=into)
        if latest is None or latest.role is Role.PLACE:
            return None
        text = latest.thing_id or latest.means
    try:
        return resolver.thing(text, use)
    except UnknownObject:
        if use is Use.ONTO and not is_like_place(text, resolver.setting.request.world.places):
            raise
        return None


def pronoun_of(text: str) -> str | None:
    """Return which pronoun a text is, such as "here" or "there", None if it is none."""
    return phrases.PRONOUNS.get(" ".join(words_of(text)) or text.strip().lower())


def _spoken_there(resolver: Resolver, use: Use, *, into: bool) -> Mention | None:
    """Return what "there" was spoken of last: not what is being moved, nor what takes nothing."""
    setting = resolver.setting
    for one in setting.spoken_of():
        if use is not Use.ONTO:
            return one
        is_moved = one in setting.mentions and one.role is Role.OBJECT
        if one.role is Role.PLACE and not into:
            return one
        if not is_moved and (one.role is Role.DESTINATION or one.kind in PUT_INTO):
            return one
    return None


def _container_of(thing: Referent, resolver: Resolver) -> str:
    """Return what a thing in the scene lies in, "" for none."""
    known = subject_of(thing.name, resolver.setting.request.scene).thing
    return known.rests.of if known and known.rests and known.rests.relation == IN else ""


def _put_here(text: str, resolver: Resolver, state: State) -> Parameters:
    world = resolver.setting.request.world
    table = state.at if is_surface(state.at, world) else nearest_furniture(state.spot, world)
    if table is None:
        raise UnknownPlace(text, set(world.places.values()))
    near = state.spot is not None and math.dist(
        state.spot, (world.sites[table].pose.x_m, world.sites[table].pose.y_m)
    ) <= HERE_M  # fmt: skip
    why = "it is here" if near or state.at == table else "the nearest furniture"
    resolver.referents.note(text, Role.DESTINATION, table, why)
    return {"destination": table, "relation": "on"}
