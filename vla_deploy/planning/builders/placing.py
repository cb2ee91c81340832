"""Build the steps of clauses that put things somewhere, back where they were, or keep them."""

import re
from collections.abc import Iterator
from typing import Any, Final

from vla_deploy.memory.episode import LastSeen
from vla_deploy.planning.builders.steps import (
    BESIDE_WORDS,
    WAYS,
    Groups,
    Step,
    arm_in,
    held_kinds,
    parts_of,
    pick,
    split_put,
)
from vla_deploy.planning.errors import NotAble
from vla_deploy.planning.interfaces import Request
from vla_deploy.planning.references import match_place
from vla_deploy.planning.understanding.conversation import Mention
from vla_deploy.planning.understanding.expressions import read_expression
from vla_deploy.planning.understanding.fitting import Use, fitting
from vla_deploy.planning.understanding.phrases import IT, PRONOUNS
from vla_deploy.planning.understanding.setting import Setting
from vla_deploy.world.relations import NEXT_TO

STORE: Final = "box"
"""What "put it away" means where nothing else is said."""
_WAY: Final = re.compile(rf"^(?:{WAYS}) ")
_TOWARDS: Final = frozenset({"to", "at", *(f"{way} to" for way in WAYS.split("|"))})
_STAYS: Final = re.compile(r" (?:in|on|at|inside) (?!your\b)")
"""Where it is to be kept is where it is."""
_INTO: Final = frozenset({"in", "into", "inside", "inside of"})


def put(groups: Groups, request: Request) -> list[Step]:
    """Put each thing somewhere, fetching it first."""
    moved, said, destination = split_put(groups, request)
    bare = match_place(destination, request.world.places)
    if said in _TOWARDS and bare is not None and bare not in request.world.furniture:
        return [*pick({**groups, "object": moved}, request), ("navigate_to", {"place": bare})]
    where: dict[str, Any] = {"destination": destination, **arm_in(groups)}
    if said not in _TOWARDS:
        how = _WAY.sub("", said)
        where["relation"] = NEXT_TO if how in BESIDE_WORDS else "in" if how in _INTO else "on"
    return _put_each(moved, **where)


def put_there(groups: Groups, _: Request) -> list[Step]:
    """Put each thing where was spoken of."""
    return _put_each(groups["object"], destination="there", **arm_in(groups))


def _put_each(things: str, **where: Any) -> list[Step]:
    return [("place", {"object": part, **where}) for part in parts_of(things)]


def put_down(groups: Groups, request: Request) -> list[Step]:
    """Put down what is held; with one thing in hand, or none, "it" tells nothing more."""
    said = groups.get("object", "it")
    if said in ("everything", "all", "both", "both of them"):
        said = "everything you are holding"
    named = {"object": said} if len(held_kinds(request)) > 1 or PRONOUNS.get(said) != IT else {}
    return [("place", {**named, **arm_in(groups)})]


def empty_hand(groups: Groups, _: Request) -> list[Step]:
    """Put down what a hand holds."""
    arm = arm_in(groups)
    return [("place", {"object": f"what is in your {arm.get('arm', '')} hand", **arm})]


def empty_hands(_: Groups, __: Request) -> list[Step]:
    """Put down all that the hands hold."""
    return [("place", {"object": "everything you are holding"})]


def put_away(groups: Groups, _: Request) -> list[Step]:
    """Put things into the box."""
    return _put_each(groups["object"], destination=STORE, relation="in")


def _may_be_held(text: str, request: Request) -> bool:
    """Tell whether a hand holds what is said, or may: "it" is whatever was spoken of."""
    setting = Setting(request)
    read = read_expression(text, setting.furniture)
    return bool(read.pronoun) or any(one.held_by for one in fitting(read, Use.PUT, setting))


def put_here(groups: Groups, _: Request) -> list[Step]:
    """Put each thing on what the robot stands before."""
    return _put_each(groups["object"], destination="here", **arm_in(groups))


def keep(groups: Groups, request: Request) -> list[Step]:
    """Go on holding what is held; take what is not."""
    if _may_be_held(groups["object"], request):
        return [("speak", {"text": "I keep it."})]
    if _STAYS.search(groups["object"]):
        return [("speak", {"text": "I leave it where it is."})]
    return pick(groups, request)


# --- where it was -------------------------------------------------------------------------------


def put_back(groups: Groups, request: Request) -> list[Step]:
    """Put a thing where it was before a hand took it.

    Raises:
        NotAble: nobody remembers where that was, or it was on nothing that takes things.
    """
    said = groups["object"]
    meant = _meant(said, request)
    for place in () if meant is None else _places(meant, request):
        relation = "in" if _is_thing(place, request) else "on"
        return [("place", {"object": said, "destination": place, "relation": relation})]
    raise NotAble("I do not remember where it was; say where it shall go")


def _meant(said: str, request: Request) -> Mention | None:
    """Return the one thing that shall go back: what is held before what was spoken of."""
    setting = Setting(request)
    read = read_expression(said, setting.furniture)
    if read.pronoun:
        spoken = (one for one in setting.spoken_of() if one.kind and one.thing_id)
        return setting.held() or next(spoken, None)
    found = fitting(read, Use.PUT, setting)
    held = [one for one in found if one.held_by] or found
    return Mention.of(held[0]) if len(held) == 1 else None


def _places(meant: Mention, request: Request) -> Iterator[str]:
    """Yield where a thing was, the surest memory first, as far as things can be put there."""
    for one in request.conversation.mentions():
        is_same = one.thing_id == meant.thing_id if meant.thing_id else one.kind == meant.kind
        if is_same and one.rested and _takes_things(one.rested, request):
            yield one.rested
    for seen in request.last_seen:
        if _is_same(seen, meant) and _takes_things(seen.place, request):
            yield str(match_place(seen.place, request.world.places))


def _is_same(seen: LastSeen, meant: Mention) -> bool:
    return seen.kind == meant.kind and meant.colour in ("", seen.colour)


def _takes_things(place: str, request: Request) -> bool:
    name = match_place(place, request.world.places)
    return name in request.world.furniture if name is not None else _is_thing(place, request)


def _is_thing(place: str, request: Request) -> bool:
    return request.scene is not None and request.scene.thing(place) is not None
