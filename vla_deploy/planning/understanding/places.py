"""Resolve places and destinations: spoken names, whole words of them, "here" and "there"."""

import math
from collections.abc import Mapping
from typing import Any, Final

from vla_deploy.planning.errors import NotAble
from vla_deploy.planning.understanding import phrases
from vla_deploy.planning.understanding.conversation import Mention, MentionRole
from vla_deploy.planning.understanding.fitting import CommandContext, ThingUse
from vla_deploy.planning.understanding.questions import which_place
from vla_deploy.planning.understanding.resolver import Referent, Resolver
from vla_deploy.plans.errors import UnknownObject, UnknownPlace
from vla_deploy.plans.knowledge import match_place, words_of
from vla_deploy.plans.symbolic.state import Pose, SymbolicState
from vla_deploy.world.relations import NEXT_TO
from vla_deploy.world.vocabulary import CONTAINERS

Parameters = Mapping[str, Any]
# That near to where one stands for a place, one is there.
AT_PLACE_M: Final = 0.8
MOST_LETTERS: Final = 60


def resolve_place(text: str, resolver: Resolver) -> str:
    """Return the place that a text means, and log why.

    Raises:
        UnknownPlace: no place is called so.
        Ambiguous: several are.
    """
    context, key, said = resolver.context, _key(text), text.strip()
    answer = context.request.conversation.choices.get(key, key)
    place = match_place(answer, context.request.world.places) or _meant(key, said, context)
    resolver.note(said, place, "a place")
    context.mentions.append(Mention(said=said, means=place, role=MentionRole.PLACE))
    return place


def _key(text: str) -> str:
    words = words_of(text.replace("_", " ")[:MOST_LETTERS])
    # "The table here" is a table.
    while len(words) > 1 and words[-1] in ("here", "there", "over"):
        words = words[:-1]
    return " ".join(words)


def _named(key: str, places: Mapping[str, str]) -> tuple[str, ...]:
    """Return the places that a text names by whole words of a name."""
    named = (one for name, one in places.items() if f" {key} " in f" {name} ")
    return tuple(dict.fromkeys(named)) if key else ()


def _meant(key: str, said: str, context: CommandContext) -> str:
    """Return the place that a part of a name means, or "there".

    Of places with a common name it is that in the room named before, here, or spoken of last.
    """
    world, view = context.request.world, context.view
    known = {*world.places.values()}
    spoken = [one.means for one in context.spoken_of() if one.role is MentionRole.PLACE]
    if phrases.PRONOUNS.get(key) in (phrases.THERE, phrases.IT):
        if not spoken:
            raise which_place(sorted(known), key, "Where do you mean?")
        return spoken[0]
    named = _named(key, world.places)
    if not named:
        raise UnknownPlace(said[:MOST_LETTERS], known)
    poses = {name: world.sites[name].pose for name in named if name in world.sites}
    in_room = [world.surface_of(one.means) for one in reversed(context.mentions)]
    here = [
        name
        for name, pose in poses.items()
        if view and math.dist((pose.x_m, pose.y_m), (view.x_m, view.y_m)) <= AT_PLACE_M
    ]
    meant = named if len(named) == 1 else (*in_room, *here, *spoken)
    place = next((one for one in meant if one in named), None)
    if place is None:
        raise which_place(named, key)
    return place


# --- where something shall go -------------------------------------------------------------------


def destination_of(given: Parameters, resolver: Resolver, state: SymbolicState) -> Parameters:
    """Return where to put it and how; without a word about it, on the nearest furniture.

    Raises:
        PlanError: where that is, is not known, or must be asked.
    """
    text = given.get("destination")
    if text is not None and not isinstance(text, str):
        return {}
    world = resolver.context.request.world
    relation = given.get("relation")
    if text is None or pronoun_of(text) == phrases.HERE:
        table = state.at if world.is_surface(state.at) else world.nearest_surface(state.spot)
        if table is None:
            raise UnknownPlace(text or "down", set(world.places.values()))
        resolver.note(text or "down", table, "the nearest furniture")
        return {"destination": table, "relation": "on"}
    thing = thing_unless_place(text, resolver, ThingUse.ONTO, into=relation == "in")
    if thing is not None:
        default = "in" if thing.kind in CONTAINERS else "on"
        return {"destination": thing.name, "relation": relation or default}
    if relation == NEXT_TO:
        raise NotAble(f"I put things next to things and on furniture, not next to {text}")
    surface = world.surface_of(resolve_place(text, resolver))
    return {"destination": surface, "relation": "on"}


def check_readable(text: Any, resolver: Resolver) -> None:
    """Refuse an unknown destination before asking which thing shall go there.

    Raises:
        UnknownObject: it names nothing known.
    """
    places = resolver.context.request.world.places
    if isinstance(text, str) and not pronoun_of(text) and not _named(_key(text), places):
        resolver.context.read(text)


def pose_parameters(pose: Pose) -> dict[str, float]:
    """Return a pose as parameters of a drive, to the millimetre and the milliradian."""
    x_m, y_m, yaw_rad = pose
    # Rounding must not make half a turn more than that.
    yaw_rad = min(max(round(math.remainder(yaw_rad, math.tau), 3), -3.141), 3.141)
    return {"x_m": round(x_m, 3), "y_m": round(y_m, 3), "yaw_rad": yaw_rad}


def thing_unless_place(
    text: str, resolver: Resolver, use: ThingUse, *, into: bool = False
) -> Referent | None:
    """Return the thing that a text names, None where it names a place by its name or no thing.

    Raises:
        UnknownObject: it is to take something, and names nothing known.
        NotAble: things are known, but none that it can mean.
        Ambiguous: only the speaker can tell.
    """
    if match_place(text, resolver.context.request.world.places):
        return None
    if pronoun_of(text) == phrases.THERE:
        latest = _spoken_there(resolver, use, into=into)
        if latest is None or latest.role is MentionRole.PLACE:
            return None
        text = latest.thing_id or latest.means
    try:
        return resolver.thing(text, use)
    except UnknownObject:
        if use is ThingUse.ONTO and not _named(_key(text), resolver.context.request.world.places):
            raise
        return None


def pronoun_of(text: str) -> str | None:
    """Return which pronoun a text is, such as "here" or "there", None if it is none."""
    return phrases.PRONOUNS.get(" ".join(words_of(text)) or text.strip().lower())


def _spoken_there(resolver: Resolver, use: ThingUse, *, into: bool) -> Mention | None:
    """Return what "there" was spoken of last: not what is being moved, nor what takes nothing."""
    context = resolver.context
    for one in context.spoken_of():
        if use is not ThingUse.ONTO:
            return one
        is_moved = one in context.mentions and one.role is MentionRole.OBJECT
        if one.role is MentionRole.PLACE and not into:
            return one
        if not is_moved and (one.role is MentionRole.DESTINATION or one.kind in CONTAINERS):
            return one
    return None
