"""Read a referring expression: "the other red one", "both cups", "the ball on my left", "it".

    expression = pronoun | [all | both | any | a | the] [other] [side] [extreme] query [on the side]
               | expression [but expression] [nearest expression] with a place in a row

Roundabout words are made plain first (`wordings`), and what singles a thing out is parted from it
(`parting`). What remains after pronouns, quantity, side and extremes is a query of the world's own
grammar (`vla_deploy.world.query`). Words that are not known are compared with those that are.
"""

import re
from collections.abc import Mapping
from dataclasses import replace
from functools import lru_cache
from typing import Final

from vla_deploy.planning.errors import UnknownObject
from vla_deploy.planning.understanding import phrases
from vla_deploy.planning.understanding.expression import Expression, Scope
from vla_deploy.planning.understanding.expression_words import (
    compounds,
    generic_support,
    of_kinds,
    pointing,
    with_known_words,
)
from vla_deploy.planning.understanding.parting import Parted, parted, side_behind
from vla_deploy.planning.understanding.wordings import reworded
from vla_deploy.world import Query, UnknownWord, parse_query
from vla_deploy.world.vocabulary import ARTICLES, OBJECT_CLASSES

MOST_LETTERS: Final = 200
_TOKEN: Final = re.compile(r"[a-z0-9_]+|&")
_TO_WHOM: Final = re.compile(
    r"\b(nearest|closest|nearer|closer|farthest|furthest) to (you|yourself|robot|the robot|me)\b"
)
_IN_HAND: Final = re.compile(
    r"(?:what|whatever|the thing|the one|the object|everything)(?: that)?"
    r"(?: you (?:(?:are|re) (?:holding|carrying)|hold|have|have got|ve|ve got|got|carry)"
    r"(?: in (?:your|the)(?: (?P<hand2>left|right))? hands?)?"
    r"|(?: is|s| you have)? in (?:your|the) (?:(?P<hand>left|right) )?hands?)"
)
_WHERE_IT_IS: Final = re.compile(r"^where (.+) (?:is|are|stands?|lies?)$")
_EVERYTHING: Final = re.compile(r"^(?:everything|anything)(?: else)?\b")
_QUANTITY: Final[tuple[tuple[re.Pattern[str], Scope], ...]] = tuple(
    (re.compile(pattern), scope)
    for pattern, scope in (
        (r"(?P<count>both)(?: of)?(?: the| my| your| these| those)? (?P<own>.+)", Scope.ALL),
        (r"(?:all|every|each)(?: one)?(?: of)?(?: the| my| your| these| those)?"
         r"(?: (?P<count>two|three|four|2|3|4))? (?P<own>.+)", Scope.ALL),
        (r"(?:the|my|your|these|those) (?P<count>two|three|four|2|3|4) (?P<own>.+)", Scope.ALL),
        (r"(?P<count>two|three|four|2|3|4|(?:an? )?(?:couple|pair)(?= of))"
         r"(?: of(?: the| my| your| these| those)?)? (?P<own>.+)", Scope.ANY),
        (r"(?:(?:any|one|either) of(?: the| my| those| these)?|any|either|an?|some) (?P<own>.+)",
         Scope.ANY),
    )
)  # fmt: skip


def read_expression(text: str, furniture: Mapping[str, str] | None = None) -> Expression:
    """Read an expression; `furniture` maps the spoken names of furniture to surfaces.

    Raises:
        UnknownObject: a word of it is like nothing that is known.
    """
    if len(text) > MOST_LETTERS:
        raise UnknownObject(f"{text[:40]}...", OBJECT_CLASSES)
    read = _read(text, tuple((furniture or {}).items()))
    if read is None:
        raise UnknownObject(text.strip(), OBJECT_CLASSES)
    return read


# Rules try many readings of a command before one is built: the same words come again and again.
@lru_cache(maxsize=1024)
def _read(text: str, named: tuple[tuple[str, str], ...]) -> Expression | None:
    """Return what an expression says, None where it says nothing that is known."""
    furniture = dict(named)
    said, by_speaker = _order_by_whom(" ".join(_TOKEN.findall(_plain(text.lower()))))
    key = " ".join(word for word in said.split() if word not in ARTICLES) or said
    pronoun = phrases.PRONOUNS.get(said) or phrases.PRONOUNS.get(key, "")
    if pronoun:
        return Expression(said=key, query=Query(), pronoun=pronoun)
    plainly = " ".join(_TOKEN.findall(_plain(reworded(text, furniture))))
    in_hand = _IN_HAND.fullmatch(said) or _IN_HAND.fullmatch(plainly)
    if in_hand:
        hand = in_hand["hand"] or in_hand["hand2"] or ""
        return Expression(said=key, query=Query(), pronoun=phrases.HELD, hand=hand)
    said, to_me = _order_by_whom(plainly)
    parts = parted(_WHERE_IT_IS.sub(r"\1", said))
    read = _description(parts, key, by_speaker or to_me, furniture)
    return None if read is None else _compared(read, parts, named)


def _description(
    parts: Parted, key: str, by_speaker: bool, furniture: Mapping[str, str]
) -> Expression | None:
    """Return what a description says by itself, without what it was parted from."""
    rest, scope, count = _quantity(parts.own)
    rest, side, my_side = side_behind(rest)
    read = Expression(
        said=key,
        query=Query(),
        scope=scope,
        count=count,
        side=side,
        by_speaker=by_speaker or my_side,
        place=parts.place,
        among=parts.among,
    )
    read = pointing(compounds(rest).split(), read)
    read = generic_support(read, furniture)
    read = with_known_words(read, furniture)
    try:
        query = parse_query(" ".join(read.words), furniture)
    except UnknownWord:
        return None
    fits = of_kinds(replace(read, query=query))
    return fits if _means_things(query, parts.own) else None


def _compared(
    read: Expression, parts: Parted, named: tuple[tuple[str, str], ...]
) -> Expression | None:
    """Return it with the things that it is compared with; None where one of them is unknown."""
    others = [_read(one, named) or _read(f"the one {one}", named) for one in parts.besides]
    others += [_read(one, named) for one in parts.between]
    others += [_read(parts.near, named)] if parts.near else []
    known = [one for one in others if one is not None and _can_compare(one)]
    if len(known) < len(others):
        return None
    besides = known[: len(parts.besides)]
    return replace(
        read,
        besides=tuple(one for one in besides if not one.pronoun),
        near=known[-1] if parts.near else None,
        between=tuple(known[len(besides) :][: len(parts.between)]),
        order=phrases.ORDER_WORDS.get(parts.order, parts.order),
        is_other=read.is_other or any(one.pronoun for one in besides),
        by_speaker=read.by_speaker or (parts.place is not None and parts.place.by_speaker),
        scope=Scope.ONE if parts.is_one_of else read.scope,
        corrections=tuple(match for one in (read, *known) for match in one.corrections),
        doubts=tuple(match for one in (read, *known) for match in one.doubts),
    )


def _can_compare(read: Expression) -> bool:
    """Tell whether another thing can be compared with it: "it" is one thing, "them" are not."""
    return read.pronoun in ("", phrases.IT) and not read.is_relative


def _means_things(query: Query, said: str) -> bool:
    """Tell whether it is about things: "a little closer" is not, "the closer one" is."""
    if query.is_named or query.colour:
        return True
    words = said.split()
    return "one" in words or "ones" in words or (words[:1] == ["the"] and len(words) > 1)


def _plain(text: str) -> str:
    return text.replace("'s", "").replace("-", "")


def _order_by_whom(said: str) -> tuple[str, bool]:
    """Return "closest to you" without "to you", and whether it is "to me"."""
    found = _TO_WHOM.search(said)
    if found is None:
        return said, False
    return _TO_WHOM.sub(r"\1", said), found[2] == "me"


def _quantity(said: str) -> tuple[str, Scope, int]:
    """Return what is meant without how many, and how many."""
    said = _EVERYTHING.sub("all objects", said)
    for pattern, scope in _QUANTITY:
        found = pattern.fullmatch(said)
        if found:
            counted = (found.groupdict().get("count") or "").split()
            count = phrases.COUNTS.get(counted[-1], 0) if counted else 0
            return found["own"], scope, count
    return said, Scope.ONE, 0
