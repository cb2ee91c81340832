"""Resolve places and destinations: spoken names, parts and slips of them, "here" and "there"."""

import math
import re
from collections.abc import Mapping
from typing import Any, Final

from vla_deploy.planning.errors import NotAble, UnknownObject, UnknownPlace
from vla_deploy.planning.knowledge import match_place, words_of
from vla_deploy.planning.symbolic.conditions import PUT_INTO
from vla_deploy.planning.symbolic.state import Pose, State, subject_of
from vla_deploy.planning.understanding import phrases
from vla_deploy.planning.understanding.conversation import Mention, Role
from vla_deploy.planning.understanding.expressions import read_expression
from vla_deploy.planning.understanding.fitting import Use
from vla_deploy.planning.understanding.names import closest
from vla_deploy.planning.understanding.questions import did_you_mean, where, which_place
from vla_deploy.planning.understanding.resolver import Referent, Resolver
from vla_deploy.world.relations import NEXT_TO
from vla_deploy.world.resting import IN

Parameters = Mapping[str, Any]
# That near to where one stands for a place, one is there.
AT_PLACE_M: Final = 0.8
MOST_LETTERS: Final = 60


def resolve_place(text: str, resolver: Resolver) -> str:
    """Return the place that a text means, and log why.

    Raises:
        UnknownPlace: no place is called so, or nearly so.
        Ambiguous: several are.
    """
    place, why = _place(_key(text), text, resolver)
    said = text.strip()
    resolver.note(said, place, why)
    resolver.setting.mentions.append(Mention(said=said, means=place, role=Role.PLACE))
    return place


def is_like_place(text: str, places: Mapping[str, str]) -> bool:
    """Tell whether a text is the name of a place, a part of one, or like one."""
    key = _key(text)
    spoken = phrases.PRONOUNS.get(key) in (phrases.THERE, phrases.HERE)
    return bool(key) and (spoken or bool(_named(key, places)) or closest(key, places) is not None)


def _key(text: str) -> str:
    words = words_of(text.replace("_", " ")[:MOST_LETTERS])
    # "The table here" is a table.
    while len(words) > 1 and words[-1] in ("here", "there", "over"):
        words = words[:-1]
    return " ".join(words)


def _named(key: str, places: Mapping[str, str]) -> tuple[str, ...]:
    """Return the places that a text names by whole words of a name."""
    part = re.compile(rf"(?:.* )?{re.escape(key)}(?: .*)?")
    return tuple(dict.fromkeys(one for name, one in places.items() if part.fullmatch(name)))


def _place(key: str, text: str, resolver: Resolver) -> tuple[str, str]:
    """Return the place that a text means, and why."""
    setting = resolver.setting
    known = setting.request.world.places
    answer = match_place(setting.request.conversation.choices.get(key, ""), known)
    if answer is not None:
        return answer, "you said so"
    exact = match_place(key, known)
    if exact is not None:
        return exact, "its name"
    if phrases.PRONOUNS.get(key) in (phrases.THERE, phrases.IT):
        for one in setting.spoken_of():
            if one.role is Role.PLACE:
                return one.means, "spoken of last"
        raise where(tuple(sorted(set(known.values()))), key)
    named = _named(key, known) if key else ()
    if named:
        return _one_of(key, named, resolver)
    match = closest(key, known) if key else None
    if match is None:
        raise UnknownPlace(text[:MOST_LETTERS], set(known.values()))
    meant = set(map(known.__getitem__, match.known))
    if match.near and len(meant) == 1:
        return meant.pop(), "its spelling"
    raise did_you_mean(match, key)


def _one_of(key: str, named: tuple[str, ...], resolver: Resolver) -> tuple[str, str]:
    """Choose among places with a common name: in the room named before, here, or spoken of."""
    setting = resolver.setting
    world, view = setting.request.world, setting.view
    if len(named) == 1:
        return named[0], "part of its name"
    for one in reversed(setting.mentions):
        if (table := world.surface_of(one.means)) in named:
            return table, f"at the {one.means}"
    for name in named:
        site = world.sites.get(name)
        if site is None or view is None:
            continue
        if math.dist((site.pose.x_m, site.pose.y_m), (view.x_m, view.y_m)) <= AT_PLACE_M:
            return name, "I am there"
    for one in setting.spoken_of():
        if one.role is Role.PLACE and one.means in named:
            return one.means, "we spoke of it just now"
    raise which_place(named, key)


# --- where something shall go -------------------------------------------------------------------


def destination_of(given: Parameters, resolver: Resolver, state: State) -> Parameters:
    """Return where to put it and how; without a word about it, on the nearest furniture.

    Raises:
        PlanningError: where that is, is not known, or must be asked.
    """
    text = given.get("destination")
    if text is not None and not isinstance(text, str):
        return {}
    world = resolver.setting.request.world
    relation = given.get("relation")
    if text is None or pronoun_of(text) == phrases.HERE:
        table = state.at if world.is_surface(state.at) else world.nearest_surface(state.spot)
        if table is None:
            raise UnknownPlace(text or "down", set(world.places.values()))
        resolver.note(text or "down", table, "the nearest furniture")
        return {"destination": table, "relation": "on"}
    thing = thing_unless_place(text, resolver, Use.ONTO, into=relation == "in")
    if thing is not None:
        if relation == NEXT_TO and (container := _container_of(thing, resolver)):
            resolver.note(text, container, "that is what it is in")
            return {"destination": container, "relation": IN}
        default = "in" if thing.kind in PUT_INTO else "on"
        return {"destination": thing.name, "relation": relation or default}
    if relation == NEXT_TO:
        raise NotAble(f"I put things next to things and on furniture, not next to {text}")
    surface = world.surface_of(resolve_place(text, resolver))
    return {"destination": surface, "relation": "on"}


def pose_parameters(pose: Pose) -> dict[str, float]:
    """Return a pose as parameters of a drive, to the millimetre and the milliradian."""
    x_m, y_m, yaw_rad = pose
    # Rounding must not make half a turn more than that.
    yaw_rad = min(max(round(math.remainder(yaw_rad, math.tau), 3), -3.141), 3.141)
    return {"x_m": round(x_m, 3), "y_m": round(y_m, 3), "yaw_rad": yaw_rad}


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
        NotAble: things are known, but none that it can mean.
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
