"""Part a description from what singles its thing out: a place in a row, what it is not, nearness.

"the second book from the left"      a book, the 2nd from the left
"any cup but the blue one"           any cup, none that is "the blue one"
"the smaller of the two balls"       the smaller ball, of two
"the cup closest to the box"         a cup, the nearest to "the box"
"the can between the cup and a book" a can, between "the cup" and "a book"
"""

import re
from dataclasses import dataclass
from typing import Final

from vla_deploy.planning.understanding.phrases import (
    COUNTS,
    EXTREMES,
    NUMBERS,
    ORDER_WORDS,
    ORDINALS,
    SIDES,
)
from vla_deploy.world.query import ORDERS
from vla_deploy.world.vocabulary import ARTICLES, COLOURS
from vla_deploy.world.words import COMPARED


@dataclass(frozen=True, slots=True, kw_only=True)
class Place:
    """Hold a place in a row, from 1, -1 for its end; `side` is where one begins to count."""

    number: int
    side: str = ""
    by_speaker: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class Parted:
    """Hold what is left of a description, and what it was parted from.

    `is_one_of` tells that it is one of several ("of the two balls"), `among` of how many;
    `between` names the two things that it is between.
    """

    own: str
    place: Place | None = None
    besides: tuple[str, ...] = ()
    order: str = ""
    near: str = ""
    is_one_of: bool = False
    among: int = 0
    between: tuple[str, ...] = ()


_SIDE_BEHIND: Final = re.compile(
    r"(?P<own>.*?) ?(?:that is )?(?:on|to|at) (?P<whose>the|your|my|its) (?P<side>left|right)"
    r"(?: hand)?(?: side)?"
)
_MIDDLE_BEHIND: Final = re.compile(
    r"(?P<own>.+?) (?:(?:that|which) (?:is|sits|stands|lies) )?"
    r"(?:in|at) the (?P<side>middle|centre|center)"
)
_DETERMINER: Final = r"(?:(?:the|my|your|that|this|our) )?"
_BESIDES: Final = re.compile(
    r"(?P<own>.+?) (?:(?:that|which|who) (?:is|are) not|(?:is|are) not|but not|not|but|except for|"
    r"except|other than|apart from|aside from|besides|excluding|without) (?P<not>.+)"
)
_OR: Final = re.compile(r" (?:or|nor|and)(?: not)? ")
_NEAR: Final = re.compile(
    r"(?P<own>.+?) (?:(?:that|which) (?:is|are) |(?:is|are) |the )?"
    r"(?P<order>nearest|closest|nearer|closer|farthest)(?: to| from)? "
    r"(?P<near>(?:the|my|your|that|this) .+)"
)
_BETWEEN: Final = re.compile(
    r"(?P<own>.+?) (?:(?:that|which) (?:is|are|stands|lies|sits) |(?:is|are) )?"
    r"(?:(?:right|lying|standing|sitting|stood) )?(?:in )?"
    r"between (?P<one>.+?) (?:and|&) (?P<other>.+)"
)
_NTH: Final = rf"(?:{'|'.join(ORDINALS)})"
_COUNTING: Final = re.compile(
    r"(?: (?:counting|counted|count|starting|seen|looking|along|in line|in (?:the|that|a) row))* "
    r"(?P<how>from|on|to|at) (?P<whose>(?:the|your|my) )?(?:far )?(?P<side>left|right)"
    r"(?: hand)?(?: side| end| edge)?(?! of\b)(?= |$)"
)
_HEAD: Final = re.compile(rf"{_DETERMINER}(?P<nth>{_NTH})(?: (?P<own>.+))?")
_TAIL: Final = re.compile(
    rf"(?P<own>.+?) (?:(?:that|which) is |is )?(?:the )?(?P<nth>{_NTH})(?: one)?"
)
_NUMBERED: Final = re.compile(rf"(?P<own>.+) number (?P<nth>{'|'.join(NUMBERS)})")
_ROW: Final = re.compile(r" in (?:the|that|a) (?:row|line)\b")
_PICKS: Final = frozenset(
    {*SIDES, *EXTREMES, *ORDERS, *ORDER_WORDS, *ORDINALS, *COLOURS, *COMPARED, "other"}
)
_ONE_OF: Final = re.compile(
    rf"{_DETERMINER}(?P<pick>\w+(?: \w+)??)(?: one)?(?: out)? of (?:all )?"
    rf"(?:the|these|those|my|your)(?: (?P<count>{'|'.join(COUNTS)}))? (?P<own>.+)"
)


def parted(said: str) -> Parted:
    """Part a description, in lower case and without punctuation."""
    amid = _BETWEEN.fullmatch(said)
    own, besides = _besides(said if amid is None else amid["own"])
    own, is_one_of, among = _one_of(own)
    near = _NEAR.fullmatch(own)
    if near:
        own = "the one" if near["own"] in ARTICLES else near["own"]
    own, place = _place(own)
    return Parted(
        own=own,
        place=place,
        besides=besides,
        order=near["order"] if near else "",
        near=near["near"] if near else "",
        is_one_of=is_one_of,
        among=among,
        between=() if amid is None else (amid["one"], amid["other"]),
    )


def _besides(said: str) -> tuple[str, tuple[str, ...]]:
    found = _BESIDES.fullmatch(said)
    if found is None:
        return said, ()
    return found["own"], tuple(_OR.split(found["not"].removeprefix("not ")))


def _one_of(own: str) -> tuple[str, bool, int]:
    """Return "the smaller balls" of "the smaller of the two balls"."""
    found = _ONE_OF.fullmatch(own)
    if found is None or not _PICKS.issuperset(found["pick"].split()):
        return own, False, 0
    return f"the {found['pick']} {found['own']}", True, COUNTS.get(found["count"] or "", 0)


def _place(own: str) -> tuple[str, Place | None]:
    """Return a description without its place in a row; "first" before an article is no such."""
    spaced = f" {own}"
    counting = _COUNTING.search(spaced)
    if counting:
        spaced = spaced[: counting.start()] + spaced[counting.end() :]
    rest = _ROW.sub("", " ".join(spaced.split()))
    head = _HEAD.fullmatch(rest)
    if head and (head["own"] or "one").split()[0] in ARTICLES:
        return own, None
    found = head or _NUMBERED.fullmatch(rest) or (_TAIL.fullmatch(rest) if counting else None)
    if found is None:
        return own, None
    number = {**ORDINALS, **NUMBERS}[found["nth"]]
    side = counting["side"] if counting else ""
    if number < 0 and counting and counting["how"] != "from":
        # "The last one on the right" is where the right ends.
        number = 1
    by_speaker = counting is not None and counting["whose"] == "my "
    return found["own"] or "one", Place(number=number, side=side, by_speaker=by_speaker)


def side_behind(rest: str) -> tuple[str, str, bool]:
    """Return the expression without "on the left" at its end, the side, and whether it is mine."""
    found = _SIDE_BEHIND.fullmatch(rest)
    if found:
        return found["own"] or "one", found["side"], found["whose"] == "my"
    found = _MIDDLE_BEHIND.fullmatch(rest)
    return (found["own"], "middle", False) if found else (rest, "", False)
