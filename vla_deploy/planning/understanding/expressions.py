"""Read a referring expression: "the other red one", "both cups", "the ball on the left", "it".

    expression  = pronoun | what a hand holds | description [but expression] [nearest to expression]
    description = [all | both | any | a | the] [second] [other] [side] [extreme] query [on the side]

What remains of a description is a query of the world's own grammar (`vla_deploy.world.query`). A
word that it does not have is compared with those that it has; one that is like none of them, and
says nothing that is listed in `phrases`, is refused: nothing is passed over.
"""

import re
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from enum import StrEnum
from functools import cache, lru_cache
from typing import Any, Final

from vla_deploy.planning.errors import DependsOnView, UnknownObject
from vla_deploy.planning.understanding import phrases
from vla_deploy.planning.understanding.names import Match, closest
from vla_deploy.world import Query, UnknownWord, parse_query
from vla_deploy.world.query import ORDERS, PHRASES
from vla_deploy.world.vocabulary import ARTICLES, COLOURS, FILLERS, OBJECT_CLASSES, SYNONYMS
from vla_deploy.world.words import COMPARED, FORMS

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
    generic word such as "table" stands for. `nth` is its place in a row, from 1, -1 for the end, 0
    for none; one begins to count at the `side`. `besides` is what it is not, `near` what it is the
    nearest to, or the farthest from, as `order` says. `among` is of how many things it is one.
    `doubts` are words that are only like a known one.
    """

    said: str
    query: Query = field(default_factory=Query)
    pronoun: str = ""
    scope: Scope = Scope.ONE
    count: int = 0
    hand: str = ""
    side: str = ""
    extreme: str = ""
    is_other: bool = False
    support: frozenset[str] = frozenset()
    nth: int = 0
    besides: "tuple[Expression, ...]" = ()
    near: "Expression | None" = None
    order: str = ""
    among: int = 0
    doubts: tuple[Match, ...] = ()

    @property
    def is_relative(self) -> bool:
        """Tell whether only the things around tell which one it is: a row, or what it is not."""
        return bool(self.nth or self.besides or self.near)


def read_expression(text: str, furniture: Mapping[str, str] | None = None) -> Expression:
    """Read an expression; `furniture` maps the spoken names of furniture to surfaces.

    Raises:
        UnknownObject: a word of it is like nothing that is known.
        DependsOnView: it is said as the speaker sees it.
    """
    if len(text) > MOST_LETTERS:
        raise UnknownObject(f"{text[:40]}...", OBJECT_CLASSES)
    return _read(text.strip(), tuple((furniture or {}).items()))


@cache
def known_words() -> frozenset[str]:
    """Return every word that a query is made of."""
    groups = (OBJECT_CLASSES, COLOURS, SYNONYMS, ARTICLES, FILLERS, COMPARED, FORMS, ORDERS)
    return frozenset(word for group in groups for word in group) | _relation_words()


# Plurals that mean another thing than several of one.
_OF_THEIR_OWN: Final = frozenset({"glasses"})
_TOKEN: Final = re.compile(r"[a-z0-9_]+|&")
_SHORTENED: Final = (
    (re.compile(r"\b(is|are)n'?t\b"), r"\1 not"),
    (re.compile(r"\b(that|which|who|one|what|whatever)'s\b"), r"\1 is"),
    (re.compile(r"'s\b|-(?!colou?red)"), ""),
)
_MINE: Final = re.compile(
    r"\b(?:on|to|at|from) my (?:left|right)\b|"
    r"\b(?:nearest|closest|nearer|closer|farthest|furthest) (?:to|from) me\b"
)
_HELD: Final = re.compile(
    r"(?P<own>.+?)(?: that| which)?(?:"
    r" you (?:(?:are|re) (?:holding|carrying)|hold|carry|have got|have|ve got|ve|got)"
    r"(?: in (?:your|the)(?: (?P<hand>left|right))? hands?)?"
    r"|(?: is| are| s| you have)? (?:in|from) your(?: (?P<hand2>left|right))? hands?"
    r"|(?: is| are| s| you have)? in the (?P<hand3>left|right) hand)"
)
_HELD_ALONE: Final = frozenset({"what", "whatever", "everything", "thing", "one", "object", "item"})
_FAR: Final = "farthest|furthest|farther|further"
# Other words for the same, so that what follows need know one of them only.
_SAME: Final = tuple(
    (re.compile(pattern), plain)
    for pattern, plain in (
        (r"^(?:what|whatever|something|things) (?:(?:that )?(?:is|are) )?"
         r"(?:lying |standing |sitting )?(?=(?:on|in|inside|under|next to|behind|beside)\b)",
         "the thing "),
        # "Everything else" is less than everything, and only an exception tells by how much.
        (r"^(?:everything|anything)(?: else(?= (?:but|except)\b))?\b", "all objects"),
        (r"^(?:those|these) (?!two\b|three\b|four\b|\d)(?=(?:[a-z]+ ){0,2}(?!keys)[a-z]+s\b)",
         "all the "),
        (r"\b(\w+) colou?red\b", r"\1"),
        (r"\b(?:far|very|extreme) (?=(?:left|right)\b)", ""),
        (rf"\b(?:{_FAR}|most) (?:to|on) the (?=(?:left|right)\b)", "on the "),
        (rf"\b(?:{_FAR})\b(?: (?:away|off))?(?: from)?", "farthest"),
        (r"\b(nearest|closest|nearer|closer|farthest)(?: to)? "
         r"(?:you|yourself|robot|the robot|here|where you are)\b", r"\1"),
        (r"^(that|this|.+ (?:on|in|inside|next to) .+?|th(?:at|is) .+?)(?: over)? (?:there|here)$",
         r"\1"),
        (r"\b(?:from|off(?: of)?) (?!(?:the )?(?:left|right)\b)", "on "),
        (r"\bout of ", "in "),
        (r"\b(?:set|bunch) of (?=keys\b)", ""),
        (r"\bremote control(?:ler)?\b", "remote"),
        (r"\b(glass|cup|bottle|can) of (?:water|tea|coffee|coke)\b", r"\1"),
    )
)  # fmt: skip
_BY: Final = re.compile(r"(?P<own>.+?)(?: over| just| right)? by (?P<other>(?:the|my|your) .+)")
_BESIDES: Final = re.compile(
    r"(?P<own>.+?) (?:(?:that|which|who) (?:is|are) not|(?:is|are) not|but not|not|but|except for|"
    r"except|other than|apart from|aside from|besides|excluding|without) (?P<not>.+)"
)
_OR: Final = re.compile(r" (?:or|nor|and)(?: not)? ")
_NEAR: Final = re.compile(
    r"(?P<own>.+?) (?:(?:that|which) (?:is|are|stands) |(?:is|are) |the )?"
    r"(?P<order>nearest|closest|nearer|closer|farthest)(?: to)? "
    r"(?P<near>(?:the|my|your|that|this) .+)"
)
_DETERMINER: Final = r"(?:(?:the|my|your|that|this|our) )?"
_COUNT: Final = "two|three|four|2|3|4"
_ONE_OF: Final = re.compile(
    rf"{_DETERMINER}(?P<pick>\w+(?: \w+)??)(?: one)?(?: out)? of (?:all )?"
    rf"(?:the|these|those|my|your)(?: (?P<count>{_COUNT}))? (?P<own>.+)"
)
_PICKS: Final = frozenset(
    {*phrases.SIDES, *phrases.EXTREMES, *ORDERS, *phrases.ORDER_WORDS, *phrases.ORDINALS, *COLOURS,
     *COMPARED, "other"}
)  # fmt: skip
_COUNTING: Final = re.compile(
    r"(?: counting| counted| starting)? (?P<how>from|on|to|at) the (?P<side>left|right)"
    r"(?: hand)?(?: side| end)?(?! of\b)(?= |$)"
)
_NTH: Final = re.compile(
    rf"{_DETERMINER}(?P<nth>{'|'.join(phrases.ORDINALS)})(?: (?P<own>.+))?"
    rf"|(?P<own2>.+) number (?P<nth2>{'|'.join(phrases.NUMBERS)})"
)
_QUANTITIES: Final = tuple(
    (re.compile(pattern), scope)
    for pattern, scope in (
        (r"(?P<count>both)(?: of)?(?: the| my| your| these| those)? (?P<own>.+)", Scope.ALL),
        (r"(?:all|every|each)(?: one)?(?: of)?(?: the| my| your| these| those)?"
         rf"(?: (?P<count>{_COUNT}))? (?P<own>.+)", Scope.ALL),
        (rf"(?:the|my|your|these|those) (?P<count>{_COUNT}) (?P<own>.+)", Scope.ALL),
        (rf"(?P<count>{_COUNT}|(?:an? )?(?:couple|pair)(?= of))"
         r"(?: of(?: the| my| your| these| those)?)? (?P<own>.+)", Scope.ANY),
        (r"(?:(?:any|one|either) of(?: the| my| those| these)?|any|either|an?|some) (?P<own>.+)",
         Scope.ANY),
    )
)  # fmt: skip
_SIDE: Final = re.compile(
    r"(?P<own>.*?) ?(?:(?:that|which) is )?(?:(?:on|to|at) (?:the|your|its) (?P<side>left|right)"
    r"(?: hand)?(?: side)?|(?:in|at) the (?P<middle>middle|centre|center))"
)


@lru_cache(maxsize=1024)
def _read(text: str, named: tuple[tuple[str, str], ...], is_part: bool = False) -> Expression:
    """Read an expression; one that `is_part` of another may leave out what it is about."""
    plain = text.lower().replace("\u2019", "'")
    for pattern, full in _SHORTENED:
        plain = pattern.sub(full, plain)
    said = " ".join(_TOKEN.findall(plain))
    key = " ".join(word for word in said.split() if word not in ARTICLES) or said
    pronoun = phrases.PRONOUNS.get(said) or phrases.PRONOUNS.get(key, "")
    if pronoun:
        return Expression(said=key, pronoun=pronoun)
    if _MINE.search(said):
        raise DependsOnView(text)
    held = _HELD.fullmatch(said)
    if held and held["own"].removeprefix("the ").removeprefix("that ") in _HELD_ALONE:
        hand = held["hand"] or held["hand2"] or held["hand3"] or ""
        return Expression(said=key, pronoun=phrases.HELD, hand=hand)
    own = held["own"] if held else said
    for pattern, same in _SAME:
        own = pattern.sub(same, own).strip()
    try:
        return _compared(own, key, named, is_part)
    except UnknownWord as error:
        raise UnknownObject(text, OBJECT_CLASSES) from error


def _compared(own: str, key: str, named: tuple[tuple[str, str], ...], is_part: bool) -> Expression:
    """Read a description with the things that it is compared with."""
    besides: tuple[str, ...] = ()
    if found := _BESIDES.fullmatch(own):
        own, besides = found["own"], tuple(_OR.split(found["not"].removeprefix("not ")))
    one_of = _ONE_OF.fullmatch(own)
    is_one_of = one_of is not None and _PICKS.issuperset(one_of["pick"].split())
    if one_of is not None and is_one_of:
        own = f"the {one_of['pick']} {one_of['own']}"
    near = _NEAR.fullmatch(own)
    if near:
        own = "the one" if near["own"] in ARTICLES else near["own"]
    own, nth, side = _in_row(own)
    read = _description(own, Expression(said=key, nth=nth, side=side), dict(named), is_part)
    others = [_part(one, named) for one in besides]
    anchor = _part(near["near"], named) if near else None
    doubts = (one.doubts for one in (read, *others, *(() if anchor is None else (anchor,))))
    count = one_of["count"] if one_of is not None and is_one_of else None
    return replace(
        read,
        besides=tuple(one for one in others if not one.pronoun),
        near=anchor,
        order=phrases.ORDER_WORDS.get(near["order"], near["order"]) if near else "",
        is_other=read.is_other or any(one.pronoun for one in others),
        scope=Scope.ONE if is_one_of else read.scope,
        among=phrases.COUNTS.get(count or "", 0),
        doubts=tuple(match for some in doubts for match in some),
    )


def _part(text: str, named: tuple[tuple[str, str], ...]) -> Expression:
    """Read what something is compared with: "it" is one thing, "them" are not."""
    read = _read(text, named, is_part=True)
    if read.pronoun not in ("", phrases.IT) or read.is_relative:
        raise UnknownObject(text, OBJECT_CLASSES)
    return read


def _in_row(own: str) -> tuple[str, int, str]:
    """Return a description without its place in a row, that, and from where one counts.

    "First" before an article is no such.
    """
    spaced = f" {own}"
    counting = _COUNTING.search(spaced)
    if counting:
        spaced = spaced[: counting.start()] + spaced[counting.end() :]
    found = _NTH.fullmatch(spaced.strip())
    if found is None or (found["own"] or "one").split()[0] in ARTICLES:
        return own, 0, ""
    number = {**phrases.ORDINALS, **phrases.NUMBERS}[found["nth"] or found["nth2"]]
    if number < 0 and counting and counting["how"] != "from":
        number = 1  # "The last one on the right" is where the right ends.
    side = counting["side"] if counting else ""
    return found["own"] or found["own2"] or "one", number, side


def _description(
    own: str, read: Expression, furniture: Mapping[str, str], is_part: bool
) -> Expression:
    """Return what a description says by itself.

    Raises:
        UnknownWord: a word of it is like nothing that is known.
    """
    rest, scope, count = _quantity(own)
    if by := _BY.fullmatch(rest):
        relation = "on" if by["other"].split(maxsplit=1)[-1] in furniture else "next to"
        rest = f"{by['own']} {relation} {by['other']}"
    if side := _SIDE.fullmatch(rest):
        rest = side["own"] or "one"
        read = replace(read, side=side["side"] or "middle")
    words, told = _pointing(rest.split(), scope)
    read = replace(read, **({"scope": scope} | told), count=count)
    words, support = _generic_support(words, furniture)
    words, doubts = _spelt(words, furniture)
    query = parse_query(" ".join(words), furniture)
    if not is_part and not _means_things(query, own):
        raise UnknownWord(own, own, OBJECT_CLASSES)
    return replace(read, query=query, support=support, doubts=doubts)


def _quantity(said: str) -> tuple[str, Scope, int]:
    """Return what is meant without how many, and how many."""
    for pattern, scope in _QUANTITIES:
        found = pattern.fullmatch(said)
        if found:
            counted = (found.groupdict().get("count") or "").split()
            return found["own"], scope, phrases.COUNTS.get(counted[-1], 0) if counted else 0
    return said, Scope.ONE, 0


def _pointing(words: list[str], scope: Scope) -> tuple[list[str], dict[str, Any]]:
    """Take side, extreme, "other", plural and modifiers out of words; return what they tell."""
    kept: list[str] = []
    told: dict[str, Any] = {}
    several = Scope.ALL if scope is Scope.ONE else scope
    for at, word in enumerate(words):
        one = _single(word)
        if word in phrases.SIDES and words[at + 1 : at + 2] != ["of"]:
            told["side"] = phrases.SIDES[word]
        elif word in phrases.EXTREMES:
            told["extreme"] = phrases.EXTREMES[word]
        elif word in ("other", "another", "different"):
            told |= {"is_other": True, **({"scope": Scope.ANY} if word == "another" else {})}
        elif word == "ones":
            told.setdefault("scope", several)
        elif word in phrases.MODIFIERS and _begin_with_kind(words[at + 1 :]):
            continue
        elif word not in phrases.SILENT:
            if one != word and not any(before in _relation_words() for before in kept):
                told.setdefault("scope", several)
            kept.append(phrases.ORDER_WORDS.get(one, one))
    return kept, told


def _begin_with_kind(words: list[str]) -> bool:
    """Tell whether words name a kind of thing before they say where it is."""
    for word in words:
        if word in _relation_words() or _is_kind(_single(word)):
            return word not in _relation_words()
    return False


def _generic_support(
    words: list[str], furniture: Mapping[str, str]
) -> tuple[list[str], frozenset[str]]:
    """Let "on the table" mean any furniture whose name ends in "table"."""
    words = [word for word in words if word not in ARTICLES]
    for at in range(len(words) - 1, 0, -1):
        if words[at - 1] != "on" or " ".join(words[at:]) in furniture:
            continue
        named = {place for name, place in furniture.items() if name.split()[-1:] == words[at:]}
        if named:
            return words[: at - 1], frozenset(named)
    return words, frozenset()


def _spelt(words: list[str], furniture: Mapping[str, str]) -> tuple[list[str], tuple[Match, ...]]:
    """Put known words in the place of misspelt ones; note those that are only like one."""
    known = known_words() | {word for name in furniture for word in name.split()}
    # Short words are like too many others.
    likely = (*OBJECT_CLASSES, *COLOURS, *(word for word in SYNONYMS if len(word) > 4))
    matches = [
        None if word in known or re.fullmatch(r"[a-z]+_\d+", word) else closest(word, likely)
        for word in words
    ]
    spelt = [match.known[0] if match else word for word, match in zip(words, matches, strict=True)]
    return spelt, tuple(one for one in matches if one and not one.is_sure)


def _means_things(query: Query, said: str) -> bool:
    """Tell whether it is about things: "a little closer" is not, "the closer one" is."""
    if query.is_named or query.colour:
        return True
    words = said.split()
    return "one" in words or "ones" in words or (words[:1] == ["the"] and len(words) > 1)


def _single(word: str) -> str:
    """Return the singular of a plural of a known kind, else the word."""
    if word in known_words() | _OF_THEIR_OWN or not word.endswith("s"):
        return word
    return next((one for one in (word[:-2], word[:-1]) if _is_kind(one)), word)


def _is_kind(word: str) -> bool:
    return SYNONYMS.get(word, word) in OBJECT_CLASSES


@cache
def _relation_words() -> frozenset[str]:
    return frozenset(word for phrase in PHRASES for word in phrase.split())
