"""Give what a hand holds to who asks for it: "hand me the phone", "let go".

What is not in a hand is brought, as ever: who wants it may not have a hand free yet.
"""

import re
from typing import Final

from vla_deploy.planning.builders import placing, steps
from vla_deploy.planning.builders.steps import Groups, Step, arm_in, held_kinds, parts_of
from vla_deploy.planning.errors import UnknownObject
from vla_deploy.planning.interfaces import Request
from vla_deploy.planning.references import words_of
from vla_deploy.planning.understanding.expressions import Expression, Scope, read_expression
from vla_deploy.planning.understanding.fitting import Use, fitting
from vla_deploy.planning.understanding.phrases import HELD, IT, PRONOUNS
from vla_deploy.planning.understanding.setting import Setting
from vla_deploy.world.query import Query
from vla_deploy.world.vocabulary import ANY_CLASS, OBJECT_CLASSES, SYNONYMS

MOST_WORDS_ALONE: Final = 7
_SOMEBODY: Final = re.compile(r"\b(?:i|i've|i'm|i'll|my|me|us|we|we've|our)\b")
"""Who lets go for somebody is told so, or told nothing else."""
_CAN: Final = re.compile(r"\b(?:i|you|we|they|it|that) can\b|\bcan (?:i|you|we)\b")
"""No tin of anything."""


def give(groups: Groups, request: Request) -> list[Step]:
    """Hand over each thing that is in a hand; bring what is not."""
    parts = parts_of(groups["object"])
    if not all(_is_in_hand(part, request) for part in parts):
        return steps.bring(groups, request)
    return [("hand_over", _named(part, request)) for part in parts]


def let_go(groups: Groups, request: Request) -> list[Step]:
    """Hand over what is held where somebody has it, or nothing else is asked; else put it down."""
    said, text = groups.get("object", IT), request.text.lower()
    is_given = _SOMEBODY.search(text) or len(text.split()) <= MOST_WORDS_ALONE
    if not is_given or not _is_in_hand(said, request):
        return placing.put_down(groups, request)
    return [("hand_over", {**_named(said, request), **arm_in(groups)})]


def _named(said: str, request: Request) -> dict[str, str]:
    """Return what tells which thing is given; with nothing else about, its name tells no more."""
    return {} if len(held_kinds(request)) == 1 and not _others(request) else {"object": said}


def _others(request: Request) -> set[str]:
    """Return the kinds of things that a command names and no hand holds."""
    words = words_of(_CAN.sub("", request.text.lower()))
    said = {SYNONYMS.get(word, SYNONYMS.get(word.removesuffix("s"), word)) for word in words}
    return (said & {*OBJECT_CLASSES}) - {ANY_CLASS, *held_kinds(request)}


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
