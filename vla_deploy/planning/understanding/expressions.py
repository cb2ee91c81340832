"""Read a referring expression: "the other red one", "both cups", "the ball on the left", "it".

    expression  = pronoun | what a hand holds | description [but description {or description}]
    description = [all | both | two | any | a | the] [other] [side] query [on the side]

What remains of a description is a query of the world's own grammar (`vla_deploy.world.query`). A
word that it does not have is refused: nothing is passed over, and nothing is guessed.
"""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from enum import StrEnum
from functools import lru_cache
from typing import Final

from vla_deploy.planning.understanding.phrases import (
    EXTREMES,
    HELD,
    IT,
    MODIFIERS,
    ORDER_WORDS,
    PRONOUNS,
    SIDES,
)
from vla_deploy.plans.catalogue import ARMS
from vla_deploy.plans.errors import DependsOnView, UnknownObject
from vla_deploy.world import Query, UnknownWord, parse_query
from vla_deploy.world.query import ORDERS, PHRASES
from vla_deploy.world.vocabulary import ARTICLES, OBJECT_CLASSES, SYNONYMS

MOST_LETTERS: Final = 200


class Scope(StrEnum):
    """Say how many things an expression means: the one, any one, or all of them."""

    ONE = "one"
    ANY = "any"
    ALL = "all"


@dataclass(frozen=True, slots=True, kw_only=True)
class Expression:
    """Hold what an expression says; `said` is its words, in lower case and without articles.

    `side` is left, right or middle, as the robot looks. `support` names the furniture that a
    generic word such as "table" stands for. `besides` is what it is not. It is a `superlative`
    where its size is compared with that of others. `count` is 0 where it is not told. What is in a
    hand is `held_by` that, or one of those.
    """

    said: str
    query: Query = field(default_factory=Query)
    pronoun: str = ""
    scope: Scope = Scope.ONE
    count: int = 0
    held_by: frozenset[str] = frozenset()
    side: str = ""
    is_superlative: bool = False
    is_other: bool = False
    support: frozenset[str] = frozenset()
    besides: "tuple[Expression, ...]" = ()

    @property
    def is_compared(self) -> bool:
        """Return whether only the things around tell which one it is."""
        pointed = self.side or self.is_other or self.held_by
        return bool(pointed or self.is_superlative or self.besides)


def read_expression(text: str, furniture: Mapping[str, str] | None = None) -> Expression:
    """Read an expression; `furniture` maps the spoken names of furniture to surfaces.

    Raises:
        UnknownObject: a word of it is not known.
        DependsOnView: it is said as the speaker sees it.
    """
    if len(text) > MOST_LETTERS:
        raise UnknownObject(f"{text[:40]}...", OBJECT_CLASSES)
    try:
        return _read(text.strip(), tuple((furniture or {}).items()))
    except UnknownWord as error:
        raise UnknownObject(text, OBJECT_CLASSES) from error


_TOKEN: Final = re.compile(r"[a-z0-9_]+|&")
# "That's", "a bottle of water".
_SAYS_NOTHING: Final = re.compile(rf"'s\b| of (?:{'|'.join(MODIFIERS)})\b")
_RELATION_WORDS: Final = frozenset(word for phrase in PHRASES for word in phrase.split())
_POINTING: Final = frozenset({"there", "here", "over"})
# "What is in your left hand", "the thing that you are holding".
_HANDS: Final = frozenset({"hand", "hands"})
_HOLDING: Final = frozenset({"hold", "holding", "carrying"})
_OF_HANDS: Final = frozenset(
    {*_HANDS, *_HOLDING, *ARMS, "that", "you", "your", "the", "are", "is", "have", "got", "in"}
)
_WHAT: Final = frozenset({"what", "whatever", "everything", "thing", "one", "the", "that"})
_EXCEPT: Final = frozenset({"but", "except", "excluding", "besides", "not"})
_OR: Final = re.compile(r" (?:or|nor|and)(?: not)? ")
# Words of a thing and where it stands, which say nothing.
_SILENT: Final = frozenset(
    {"is", "are", "which", "standing", "lying", "sitting", "resting", "please", "lies", "stands",
     "coloured", "colored", "control", "his", "her", "their", "its"}
)  # fmt: skip
# How many of them are meant; two of more than two are not told apart.
_QUANTITIES: Final[Mapping[str, tuple[Scope, int]]] = {
    **dict.fromkeys(("all", "every", "each", "everything"), (Scope.ALL, 0)),
    **dict.fromkeys(("both", "two", "2"), (Scope.ALL, 2)),
    **dict.fromkeys(("any", "a", "an", "some", "another"), (Scope.ANY, 0)),
}
_STANDS_FOR: Final = {
    "another": ["other"], "everything": ["object"], "what": ["object"], "whatever": ["object"]
}  # fmt: skip
_DETERMINERS: Final = frozenset({*_QUANTITIES, *_STANDS_FOR, *ARTICLES, "these", "those"})
_BEFORE_SIDE: Final[tuple[list[str], ...]] = (["on"], ["to"], ["at"], ["in"])
_AFTER_SIDE: Final[tuple[list[str], ...]] = ([], ["side"], ["hand", "side"])
# Plurals that mean another thing than several of one.
_OF_THEIR_OWN: Final = frozenset({"glasses"})


@lru_cache(maxsize=1024)
def _read(text: str, named: tuple[tuple[str, str], ...]) -> Expression:
    plain = text.lower().replace("\u2019", "'").replace("n't", " not")
    words = _TOKEN.findall(_SAYS_NOTHING.sub("", plain))
    while len(words) > 1 and words[0] in ("that", "this") and words[-1] in _POINTING:
        words.pop()
    said = " ".join(words)
    key = " ".join(word for word in words if word not in ARTICLES) or said
    if pronoun := PRONOUNS.get(said) or PRONOUNS.get(key):
        return Expression(said=key, pronoun=pronoun)
    if "my left" in said or "my right" in said:
        raise DependsOnView(text)
    words, held_by = _held(words)
    if held_by and _WHAT.issuperset(words):
        return Expression(said=key, pronoun=HELD, held_by=held_by)
    at = next((n for n, word in enumerate(words) if word in _EXCEPT), len(words))
    read = replace(_description(words[:at], dict(named)), said=key, held_by=held_by)
    if at == len(words):
        return read
    if held_by:  # of the exception, or of the rest?
        raise UnknownWord(text, words[at], OBJECT_CLASSES)
    return _with_exceptions(read, words[at:], dict(named))


def _held(words: list[str]) -> tuple[list[str], frozenset[str]]:
    """Take "that you are holding", "in your left hand" off the end; return which hands that are."""
    for at in range(1, len(words)):
        told = {*words[at:]}
        if told <= _OF_HANDS and (told & _HOLDING or ("in" in told and told & _HANDS)):
            return words[:at], frozenset(told & {*ARMS} or ARMS)
    return words, frozenset()


def _with_exceptions(
    read: Expression, words: Sequence[str], furniture: Mapping[str, str]
) -> Expression:
    """Return an expression with what it is not: "but the red ones", "not it"."""
    start = next((n for n, one in enumerate(words) if one not in {*_EXCEPT, "for"}), len(words))
    parts = _OR.split(" ".join(words[start:]))
    pronouns = {PRONOUNS[part] for part in parts if part in PRONOUNS}
    if not pronouns <= {IT} or "one" in parts:
        raise UnknownWord(read.said, " ".join(parts), OBJECT_CLASSES)
    others = (_description(part.split(), furniture) for part in parts if part not in PRONOUNS)
    return replace(read, besides=tuple(others), is_other=read.is_other or bool(pronouns))


def _description(spoken: Sequence[str], furniture: Mapping[str, str]) -> Expression:
    """Return what a description says.

    Raises:
        UnknownWord: a word of it is not known, or it is about no thing.
    """
    said = " ".join(spoken)
    words, scope, count = _quantity(spoken)
    words, side = _side([ORDER_WORDS.get(one, one) for one in words if one not in _SILENT])
    own = next((n for n, word in enumerate(words) if word in _RELATION_WORDS), len(words))
    kept = list[str]()
    for at, word in enumerate(words):
        is_first = at == 0 or words[at - 1] in _RELATION_WORDS
        if word in ORDERS and not is_first and at < len(words) - 1:
            # "The one nearest the book" is no "nearest book".
            raise UnknownWord(said, word, OBJECT_CLASSES)
        is_modifier = word in MODIFIERS and any(map(_is_kind, words[at + 1 : own]))
        if not is_modifier and not (at < own and word in ("other", "ones")):
            kept.append(EXTREMES.get(word, _single(word)))
    is_plural = any(word == "ones" or word != _single(word) for word in words[:own])
    kept, support = _generic_support(kept, furniture)
    query = parse_query(" ".join(kept), furniture)
    read = Expression(
        said=said,
        query=query,
        scope=Scope.ALL if is_plural and scope is Scope.ONE else scope,
        count=count,
        side=side,
        is_superlative=not EXTREMES.keys().isdisjoint(words),
        is_other="other" in words[:own],
        support=support,
    )
    # "A little closer" is about no thing, "the little one" is.
    tells = query != Query() or side or support or read.is_other
    stands_alone = "one" in spoken or "ones" in spoken or spoken[:1] == ["the"]
    if not (query.is_named or query.colour or (tells and stands_alone)):
        raise UnknownWord(said, said, OBJECT_CLASSES)
    return read


def _quantity(spoken: Sequence[str]) -> tuple[list[str], Scope, int]:
    """Return what is meant without articles and without how many, and how many."""
    words, scope, count = list(spoken), Scope.ONE, 0
    if words[:2] == ["one", "of"]:
        words[0] = "any"
    while words and (words[0] in _DETERMINERS or (words[0] == "of" and scope is not Scope.ONE)):
        if scope is Scope.ANY and words[0] in _QUANTITIES:
            break  # "one of two" is neither any nor both
        word = words.pop(0)
        scope, count = _QUANTITIES.get(word, (scope, count))
        words = [*_STANDS_FOR.get(word, ()), *words]
    return [word for word in words if word not in ARTICLES], scope, count


def _side(words: list[str]) -> tuple[list[str], str]:
    """Take "left", or "on the left side" at the end, out of words; return it, too."""
    for at, word in enumerate(words):
        before, after = words[:at], words[at + 1 :]
        if word not in SIDES or after[:1] == ["of"]:
            continue
        if before[-1:] in _BEFORE_SIDE and after in _AFTER_SIDE:
            return before[:-1], SIDES[word]
        if _RELATION_WORDS.isdisjoint(before):
            return [*before, *after], SIDES[word]
    return words, ""


def _generic_support(
    words: list[str], furniture: Mapping[str, str]
) -> tuple[list[str], frozenset[str]]:
    """Let "on the table" mean any furniture whose name ends in "table"."""
    if words[-2:-1] != ["on"] or words[-1] in furniture:
        return words, frozenset()
    named = {one for called, one in furniture.items() if called.split()[-1:] == words[-1:]}
    return (words[:-2] if named else words), frozenset(named)


def _single(word: str) -> str:
    """Return the singular of a plural of a known kind, else the word."""
    if not word.endswith("s") or _is_kind(word) or word in _OF_THEIR_OWN:
        return word
    return next((one for one in (word[:-2], word[:-1]) if _is_kind(one)), word)


def _is_kind(word: str) -> bool:
    return SYNONYMS.get(word, word) in OBJECT_CLASSES
