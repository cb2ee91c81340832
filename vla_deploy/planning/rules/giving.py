"""Give what a hand holds to who asks for it: "hand me the phone", "I'll take that cup", "let go".

What is not in a hand is brought, as ever: who wants it may not have a hand free yet.
"""

import re
from typing import Final

from vla_deploy.planning.asking import Request
from vla_deploy.planning.catalogue import ARMS
from vla_deploy.planning.errors import NotUnderstood, UnknownObject
from vla_deploy.planning.rules import building, placing
from vla_deploy.planning.rules.building import Groups, Step, arm_in, held_kinds, parts_of
from vla_deploy.planning.rules.intents import Intent
from vla_deploy.planning.rules.lending import kinds_told
from vla_deploy.planning.rules.pattern_parts import OBJECT, Row
from vla_deploy.planning.understanding.expression import Expression, Scope
from vla_deploy.planning.understanding.expressions import read_expression
from vla_deploy.planning.understanding.fitting import Use, fitting
from vla_deploy.planning.understanding.phrases import HELD, IT, PRONOUNS
from vla_deploy.planning.understanding.setting import Setting
from vla_deploy.world.query import Query

MOST_WORDS_ALONE: Final = 7
_SOMEBODY: Final = re.compile(r"\b(?:i|i've|i'm|i'll|my|me|us|we|we've|our)\b")
"""Who lets go for somebody is told so, or told nothing else."""
_CAN: Final = re.compile(r"\b(?:i|you|we|they|it|that) can\b|\bcan (?:i|you|we)\b")
"""No tin of anything."""
_FROM_YOU: Final = r"(?: (?:off|from) (?:you|your hands?)| back| now| then| here)*"


def give(groups: Groups, request: Request) -> list[Step]:
    """Hand over each thing that is in a hand; bring what is not."""
    parts = parts_of(groups["object"])
    if not all(_is_in_hand(part, request) for part in parts):
        return building.bring(groups, request)
    return [("hand_over", _named(part, request)) for part in parts]


def let_take(groups: Groups, request: Request) -> list[Step]:
    """Hand over what is in a hand: of anything else the speaker tells what they do themselves.

    Raises:
        NotUnderstood: no hand holds it.
    """
    if not all(_is_in_hand(part, request) for part in parts_of(groups["object"])):
        raise NotUnderstood(request.text)
    return give(groups, request)


def let_go(groups: Groups, request: Request) -> list[Step]:
    """Hand over what is held where somebody has it, or nothing else is asked; else put it down."""
    said, text = groups.get("object", IT), request.text.lower()
    is_given = _SOMEBODY.search(text) or len(text.split()) <= MOST_WORDS_ALONE
    if not is_given or not _is_in_hand(said, request):
        return placing.put_down(groups, request)
    return [("hand_over", {**_named(said, request), **arm_in(groups)})]


def change_hands(groups: Groups, request: Request) -> list[Step]:
    """Put down what one hand holds, and take it with the other: in the air it might fall."""
    free = (hand for hand, kind in request.world.holding.items() if not kind)
    arm = groups["hand"] if groups["hand"] in ARMS else next(free, "")
    if not arm or not _is_in_hand(groups["object"], request):
        raise NotUnderstood(request.text)
    thing = {"object": groups["object"]}
    return [("place", thing), ("pick_up", {**thing, "arm": arm})]


def _named(said: str, request: Request) -> dict[str, str]:
    """Return what tells which thing is given; with nothing else about, its name tells no more."""
    return {} if len(held_kinds(request)) == 1 and not _others(request) else {"object": said}


def _others(request: Request) -> set[str]:
    """Return the kinds of things that a command names and no hand holds."""
    return kinds_told([_CAN.sub("", request.text.lower())]) - {*held_kinds(request)}


def _is_in_hand(text: str, request: Request) -> bool:
    """Tell whether a text means something that is held, before anything else is done."""
    if PRONOUNS.get(text) == IT:
        return bool(held_kinds(request)) and not _others(request)
    setting = Setting(request)
    try:
        read = read_expression(text, setting.furniture)
        found = fitting(read, Use.PUT, setting)
    except UnknownObject:
        return False
    if read.pronoun == HELD:
        return any(kind for hand, kind in request.world.holding.items() if read.hand in ("", hand))
    if _is_plain(read):
        return read.query.kind in held_kinds(request) or any(one.held_by for one in found)
    return bool(found) and read.scope is Scope.ONE and all(one.held_by for one in found)


def _is_plain(read: Expression) -> bool:
    """Tell whether only a kind is named: "the cup"."""
    compares = read.is_relative or read.is_other or read.side or read.extreme or read.support
    is_one = read.scope is Scope.ONE and read.count <= 1
    return is_one and not compares and read.query == Query(kind=read.query.kind)


_FROM_HAND: Final = (
    r"(?: from (?:your|the) (?:left|right)(?: (?:hand|one|gripper))?)?(?: over| across)?"
)
ROWS: Final[tuple[Row, ...]] = (
    (Intent.MANIPULATION, rf"(?:swap|pass|change|move|put|take|switch|transfer|shift|hand) {OBJECT}"
     rf"(?: over| across)?{_FROM_HAND} (?:in)?to (?:your|the) (?P<hand>left|right|other)"
     r"(?: (?:hand|one|gripper|claw))?", change_hands),
    (Intent.MANIPULATION, rf"(?:give|hand|pass|lend) (?:me|us)(?: back| over)? {OBJECT}"
     rf"{_FROM_YOU}", give),
    (Intent.MANIPULATION, rf"(?:hand|pass|give) over (?P<object2>.+?)(?: to (?:me|us))?|"
     rf"(?:hand|pass|give) {OBJECT} (?:(?:over|across|here|back)(?: here)?(?: to (?:me|us))?|"
     r"to (?:me|us))", give),
    (Intent.MANIPULATION, rf"i(?:'ll| will) (?:take|have) {OBJECT}{_FROM_YOU}|"
     rf"(?:can|could|may|might) i (?:please |just )*(?:have|get) (?P<object2>.+?){_FROM_YOU}",
     give),
    (Intent.MANIPULATION, rf"(?:i(?:'ll| will| can) (?:take|grab)|let (?:me|us) (?:take|have|grab)|"
     rf"(?:can|could|may|might) i (?:please |just )*take) {OBJECT}(?: (?:off|from) (?:you|your "
     r"hands?))(?: back| now| then| here)*|let (?:me|us) (?:take|have|grab) (?P<object2>it|that)"
     r"(?: now| then| here)*", let_take),
    (Intent.MANIPULATION, r"(?:you (?:can|may) )?(?:let go(?: of)?|release|let loose(?: of)?)"
     r"(?: (?P<object>it|that|this|them))?|(?:you (?:can|may) )?let (?P<object2>it|that|this|them) "
     r"(?:go|loose)", let_go),
    (Intent.MANIPULATION, rf"(?:you (?:can|may) )?(?:let go of|release|let loose of) {OBJECT}",
     let_go),
)  # fmt: skip
