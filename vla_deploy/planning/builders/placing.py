"""Build the steps of clauses that put things somewhere, or keep them in the hand."""

import re
from typing import Any, Final

from vla_deploy.planning.builders.steps import (
    BESIDE_WORDS,
    NO_THING,
    WAYS,
    Groups,
    Step,
    arm_in,
    held_kinds,
    parts_of,
    pick,
    split_put,
)
from vla_deploy.planning.errors import NotAble, UnknownObject
from vla_deploy.planning.interfaces import Request
from vla_deploy.planning.references import match_place
from vla_deploy.planning.understanding.conversation import Role
from vla_deploy.planning.understanding.expressions import read_expression
from vla_deploy.planning.understanding.fitting import Use, fitting
from vla_deploy.planning.understanding.insertions import surface_of
from vla_deploy.planning.understanding.phrases import IT, PRONOUNS
from vla_deploy.planning.understanding.setting import Setting
from vla_deploy.world.relations import NEXT_TO
from vla_deploy.world.vocabulary import OBJECT_CLASSES

STORE: Final = "box"
"""What "put it away" means where nothing else is said."""
_WAY: Final = re.compile(rf"^(?:{WAYS}) ")
_TOWARDS: Final = frozenset({"to", "at", *(f"{way} to" for way in WAYS.split("|"))})
_STAYS: Final = re.compile(r" (?:in|on|at|inside) (?!your\b)")
"""Where it is to be kept is where it is."""
_SIDE_OF: Final = re.compile(r"(?:the |your |my )?(?:left|right|front|back|rear)(?: side)? of\b")
_INTO: Final = frozenset({"in", "into", "inside", "inside of"})


def put(groups: Groups, request: Request) -> list[Step]:
    """Put each thing somewhere, fetching it first.

    Raises:
        UnknownObject: where to is no more than a side.
    """
    moved, said, destination = split_put(groups, request)
    if _SIDE_OF.match(destination):
        raise NotAble("I can put things in, on or next to something, not to one side of it")
    if NO_THING.search(destination):
        raise UnknownObject(destination, OBJECT_CLASSES)
    bare = match_place(destination, request.world.places)
    if said in _TOWARDS and bare is not None and bare not in request.world.furniture:
        return [*pick({**groups, "object": moved}, request), ("navigate_to", {"place": bare})]
    where: dict[str, Any] = {"destination": destination, **arm_in(groups)}
    if said not in _TOWARDS:
        where["relation"] = _relation(_WAY.sub("", said))
    return _put_each(moved, **where)


def _relation(said: str) -> str:
    if said in BESIDE_WORDS:
        return NEXT_TO
    return "in" if said in _INTO else "on"


def put_there(groups: Groups, request: Request) -> list[Step]:
    """Put each thing where was spoken of; what is there already is what shall be taken."""
    if _is_there(groups["object"], request):
        return pick(groups, request)
    return _put_each(groups["object"], destination="there", **arm_in(groups))


def _put_each(things: str, **where: Any) -> list[Step]:
    return [("place", {"object": part, **where}) for part in parts_of(things)]


def _is_there(text: str, request: Request) -> bool:
    """Tell whether a thing stands at the place that was spoken of last."""
    setting = Setting(request)
    place = next((one.means for one in setting.spoken_of() if one.role is Role.PLACE), "")
    try:
        found = fitting(read_expression(text, setting.furniture), Use.TAKE, setting)
    except UnknownObject:
        return False
    table = surface_of(place, request.world)
    return bool(found) and all(one.rests is not None and one.rests.of == table for one in found)


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


def empty_hands(groups: Groups, _: Request) -> list[Step]:
    """Put down, here or somewhere, all that the hands hold."""
    where: dict[str, Any] = {}
    if "destination" in groups:
        where = {"destination": groups["destination"], "relation": _relation(groups["relation"])}
    return [("place", {"object": "everything you are holding", **where})]


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
