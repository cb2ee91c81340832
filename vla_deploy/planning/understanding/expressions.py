"""Read a referring expression: "the other red one", "both cups", "the ball on my left", "it".

    expression = pronoun | [all | both | any | a | the] [other] [side] [extreme] query [on the side]

What remains after pronouns, quantity, side and extremes is a query of the world's own grammar
(`vla_deploy.world.query`). Words that are not known are compared with those that are.
"""

import re
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from enum import StrEnum
from functools import cache, lru_cache
from typing import Final

from vla_deploy.planning.errors import UnknownObject
from vla_deploy.planning.understanding import phrases
from vla_deploy.planning.understanding.names import Match, closest
from vla_deploy.world import Query, UnknownWord, parse_query
from vla_deploy.world.query import ORDERS
from vla_deploy.world.query import PHRASES as RELATION_PHRASES
from vla_deploy.world.vocabulary import ARTICLES, COLOURS, FILLERS, OBJECT_CLASSES, SYNONYMS
from vla_deploy.world.words import COMPARED, FORMS


class Scope(StrEnum):
    """Say how many things an expression means: the one, any one, or all of them."""

    ONE = "one"
    ANY = "any"
    ALL = "all"


@dataclass(frozen=True, slots=True, kw_only=True)
class Expression:
    """Hold what an expression says; `said` is its words, in lower case and without articles.

    `side` is left, right or middle, from the speaker's view where `by_speaker`. `support` names
    the furniture that a generic word such as "table" stands for. `corrections` are words taken for
    others, `doubts` those that only sound like a known one.
    """

    said: str
    query: Query
    pronoun: str = ""
    scope: Scope = Scope.ONE
    count: int = 0
    hand: str = ""
    side: str = ""
    by_speaker: bool = False
    extreme: str = ""
    is_other: bool = False
    support: frozenset[str] = frozenset()
    corrections: tuple[Match, ...] = ()
    doubts: tuple[Match, ...] = ()
    words: tuple[str, ...] = field(default=(), repr=False)


MOST_LETTERS: Final = 200
_SHORT: Final = 4
_ID: Final = re.compile(r"[a-z]+_\d+")
_TOKEN: Final = re.compile(r"[a-z0-9_]+")
_SIDE_BEHIND: Final = re.compile(
    r"(?P<own>.*?) ?(?:that is )?(?:on|to|at) (?P<whose>the|your|my|its) (?P<side>left|right)"
    r"(?: hand)?(?: side)?"
)
_TO_WHOM: Final = re.compile(
    r"\b(nearest|closest|nearer|closer|farthest|furthest) to (you|yourself|robot|the robot|me)\b"
)
# Where one takes a thing from is where it is.
_FROM: Final = ((re.compile(r"\b(?:from|off(?: of)?) (?!me\b)"), "on "),
                (re.compile(r"\bout of "), "in "))  # fmt: skip
_MIDDLE_BEHIND: Final = re.compile(r"(?P<own>.+?) (?:in|at) the (?P<side>middle|centre|center)")
_IN_HAND: Final = re.compile(
    r"(?:what|whatever|the thing|the one|the object|everything)(?: that)?"
    r"(?: you (?:are holding|hold|have|have got|carry|are carrying)"
    r"|(?: is|s| you have)? in (?:your|the) (?:(?P<hand>left|right) )?hands?)"
)
_WHERE_IT_IS: Final = re.compile(r"^where (.+) (?:is|are|stands?|lies?)$")
_EVERYTHING: Final = re.compile(r"^(?:everything|anything)(?: else)?\b")
_QUANTITY: Final[tuple[tuple[re.Pattern[str], Scope], ...]] = tuple(
    (re.compile(pattern), scope)
    for pattern, scope in (
        (r"(?:all|both|every|each)(?: one)?(?: of)?(?: the| my| your| these| those)? (?P<own>.+)",
         Scope.ALL),
        (r"(?:the |my |these |those )?(?P<count>two|three|four|2|3|4) (?P<own>.+)", Scope.ALL),
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
    said = " ".join(_TOKEN.findall(text.lower().replace("'s", "").replace("-", "")))
    said, by_speaker = _order_by_whom(said)
    key = " ".join(word for word in said.split() if word not in ARTICLES) or said
    pronoun = phrases.PRONOUNS.get(said) or phrases.PRONOUNS.get(key, "")
    if pronoun:
        return Expression(said=key, query=Query(), pronoun=pronoun)
    in_hand = _IN_HAND.fullmatch(said)
    if in_hand:
        return Expression(said=key, query=Query(), pronoun=phrases.HELD, hand=in_hand["hand"] or "")
    said = _WHERE_IT_IS.sub(r"\1", said)
    rest, scope, count = _quantity(said)
    rest, side, my_side = _side_behind(rest)
    words = _compounds(rest).split()
    read = Expression(
        said=key,
        query=Query(),
        scope=scope,
        count=count,
        side=side,
        by_speaker=by_speaker or my_side,
    )
    read = _pointing(words, read)
    read = _generic_support(read, furniture)
    read = _known_words(read, furniture)
    try:
        query = parse_query(" ".join(read.words), furniture)
    except UnknownWord:
        return None
    return replace(read, query=query) if _means_things(query, said) else None


def _means_things(query: Query, said: str) -> bool:
    """Tell whether it is about things: "a little closer" is not, "the closer one" is."""
    if query.is_named or query.colour:
        return True
    words = said.split()
    return "one" in words or "ones" in words or (words[:1] == ["the"] and len(words) > 1)


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
            count = phrases.COUNTS.get(found.groupdict().get("count") or "", 0)
            return found["own"], scope, count
    return said, Scope.ONE, 0


def _side_behind(rest: str) -> tuple[str, str, bool]:
    """Return the expression without "on the left" at its end, the side, and whether it is mine."""
    found = _SIDE_BEHIND.fullmatch(rest)
    if found:
        return found["own"] or "one", found["side"], found["whose"] == "my"
    found = _MIDDLE_BEHIND.fullmatch(rest)
    return (found["own"], "middle", False) if found else (rest, "", False)


def _compounds(rest: str) -> str:
    for pattern, word in _FROM:
        rest = pattern.sub(word, rest)
    for spoken, word in phrases.COMPOUNDS.items():
        rest = re.sub(rf"\b{spoken}\b", word, rest)
    return rest


def _pointing(words: list[str], read: Expression) -> Expression:
    """Take side, extreme, "other", plural and modifiers out of the words."""
    kept: list[str] = []
    changes: dict[str, object] = {}
    for at, word in enumerate(words):
        following = " ".join(words[at + 1 : at + 2])
        if word in phrases.SIDES and following != "of":
            changes["side"] = phrases.SIDES[word]
        elif word in phrases.EXTREMES:
            changes["extreme"] = phrases.EXTREMES[word]
        elif word in ("other", "another", "different"):
            changes["is_other"] = True
            changes |= {"scope": Scope.ANY} if word == "another" else {}
        elif word in phrases.SILENT or (word in phrases.MODIFIERS and _is_kind(following)):
            continue
        else:
            single = _single(word)
            if single != word and not _has_relation(kept):
                changes.setdefault("scope", Scope.ALL if read.scope is Scope.ONE else read.scope)
            kept.append(phrases.ORDER_WORDS.get(single, single))
    return replace(read, words=tuple(kept), **changes)  # type: ignore[arg-type]


def _has_relation(kept: list[str]) -> bool:
    return any(word in _relation_words() for word in kept)


def _generic_support(read: Expression, furniture: Mapping[str, str]) -> Expression:
    """Let "on the table" mean any furniture whose name ends in "table"."""
    words = [word for word in read.words if word not in ARTICLES]
    for at in range(len(words) - 1, 0, -1):
        spoken = " ".join(words[at:])
        if words[at - 1] != "on" or spoken in furniture:
            continue
        named = {place for name, place in furniture.items() if name.split()[-1:] == words[at:]}
        if named:
            return replace(read, words=tuple(words[: at - 1]), support=frozenset(named))
    return read


def _known_words(read: Expression, furniture: Mapping[str, str]) -> Expression:
    """Put known words in the place of misspelt ones; note those that only sound alike."""
    known = _known() | frozenset(word for name in furniture for word in name.split())
    matches = [
        None if word in known or _ID.fullmatch(word) else closest(word, _likely())
        for word in read.words
    ]
    return replace(
        read,
        words=tuple(
            match.known[0] if match else word
            for word, match in zip(read.words, matches, strict=True)
        ),
        corrections=tuple(one for one in matches if one and one.is_sure),
        doubts=tuple(one for one in matches if one and not one.is_sure),
    )


def _single(word: str) -> str:
    """Return the singular of a plural of a known kind, else the word."""
    if word in _known() or not word.endswith("s"):
        return word
    return next((one for one in (word[:-2], word[:-1]) if _is_kind(one)), word)


def _is_kind(word: str) -> bool:
    return SYNONYMS.get(word, word) in OBJECT_CLASSES


@cache
def _likely() -> tuple[str, ...]:
    """Return the words that a name may be a slip of; short words are like too many others."""
    return (*OBJECT_CLASSES, *COLOURS, *(word for word in SYNONYMS if len(word) > _SHORT))


@cache
def _relation_words() -> frozenset[str]:
    return frozenset(word for phrase in RELATION_PHRASES for word in phrase.split())


@cache
def _known() -> frozenset[str]:
    groups = (OBJECT_CLASSES, COLOURS, SYNONYMS, ARTICLES, FILLERS, COMPARED, FORMS, ORDERS)
    return frozenset(word for group in groups for word in group) | _relation_words()
