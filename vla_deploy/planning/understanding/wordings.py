"""Bring roundabout ways of describing a thing into the plain ones that the reader knows.

"the coffee table's cup" is "the cup on the coffee table", "a cup that isn't red" is "a cup that is
not red", "the book with the brown cover" is "the brown book": one table, row after row.
"""

import re
from collections.abc import Mapping
from functools import lru_cache
from typing import Final

from vla_deploy.planning.understanding.embellishments import plain_description
from vla_deploy.world.vocabulary import COLOURS

_COLOUR: Final = rf"(?P<colour>{'|'.join((*COLOURS, 'gray', 'violet'))})"
# Parts that give a thing its colour; a lid or a handle may have another one.
_HULL: Final = r"(?:cover|jacket|binding|shell|casing|skin|surface|outside)"
_HERE: Final = r"(?:from|than|to) (?:here|where (?:you|we) (?:are|stand))"
_YOU_HOLD: Final = r"you(?:'ve got| have got| have|'re holding| are holding| hold| are carrying) ?"
_ROWS: Final[tuple[tuple[str, str], ...]] = (
    (r",? ?\bplease\b", ""),
    (r"\bmore (small|tall|long|short|high|low)\b", r"\1er"),
    (r"\bmore (?:big|large)\b", "bigger"),
    (r"\b(is|are)n'?t\b", r"\1 not"),
    (r"\b(that|which|who|one)'s\b", r"\1 is"),
    (r"\b(is|are) neither (?=.+ nor )", r"\1 not "),
    (r"^(?:what|whatever)(?:'s| is) (?:lying |standing |sitting )?"
     r"(?=(?:on|in|inside|under|next to|behind|beside)\b(?! (?:your|the) (?:left |right )?hand))",
     "the thing "),
    (r"^(?:what|whatever)(?:'s| is) (?:lying |standing |sitting )?(?:in )?between\b",
     "the thing between"),
    (rf"^(?:what|whatever)(?:'s| is) {_COLOUR}\b", r"the \g<colour> thing"),
    (r"^(?:whichever|whatever|any) (\w+) (?:that )?you (?:can )?(?:find|see|like|come across)"
     r"(?: lying| standing)?(?: (?:about|around|in) (?=the ))?", r"any \1 in "),
    (r" in $", ""),
    (r"^(?:whichever|whatever) (?=[a-z]+ (?:that )?(?:is|isn't)\b)", "the "),
    (r"^(the [a-z]+) (is|isn't) (?=(?:not )?(?:on|in|inside|under|next to|behind|beside)\b)",
     r"\1 that \2 "),
    (r"^something (?:(?:that )?is )?(?:lying |standing |sitting )?"
     r"(?=(?:on|in|inside|under|next to|behind|beside)\b)", "the thing "),
    (r"^((?:the |that |a |my )?(?:[a-z]+ )?(?:box|bowl)) with (?:the|my|your|his|her|our|their) "
     r"[a-z]+(?: [a-z]+)?$", r"\1"),
    # --- what a hand holds
    (rf"^(?:the |that )?(?:{_COLOUR} )?(?:thing|one|object|item) (?:that |which )?"
     rf"(?:is |{_YOU_HOLD})?(?P<hand>in (?:the|your) (?:left|right) hand)$",
     r"what you have \g<hand>"),
    (rf"^(?!what)(.+?)(?: that| which)? {_YOU_HOLD}"
     r"(?:in (?:the|your) (?:(?:left|right) )?hands?)?$", r"\1"),
    (r"^(?:the |my |that )?(?!what\b)(.+?) (?:from|in) your (?:(?:left|right) )?hand$", r"the \1"),
    (r"^anything (?=but|except|other than|apart from)", "any object "),
    (rf"\bnon[- ]?{_COLOUR} (.+)", r"\2 that is not \g<colour>"),
    (rf"\b{_COLOUR}(?:[- ]colou?red| in colou?r)\b", r"\g<colour>"),
    (rf"\bof (?:a )?{_COLOUR} colou?r\b", r"\g<colour>"),
    (rf"(.+?) (?:with|in) (?:a|an|the|its) {_COLOUR} {_HULL}\b", r"\g<colour> \1"),
    (r"^(?:those|these) ((?:[a-z]+ )?keys)\b", r"the \1"),
    (r"^(?:those|these) (?!two\b|three\b|four\b|\d)(?=(?:[a-z]+ ){0,2}[a-z]+s\b)", "all the "),
    # --- how far
    (r"\b(?:far|very|extreme) (?=(?:left|right)\b)", ""),
    (r"\b(?:that|which) (?:stands?|lies?|sits?|is (?:standing|lying|sitting)) (?=(?:on|in|to|next|"
     r"beside|near|by|left|right|at)\b)", "that is "),
    (r"\bon the (left|right) of (?=(?:the|my|that)\b)", r"to the \1 of "),
    (r"^(the|that) ((?:[a-z]+ )?[a-z]+) (?:at|on) the (left|right)(?: hand)? (?:end|side|edge) of "
     r"(?=the )", r"\1 \3most \2 on "),
    (r"\b(?:at|on) the (left|right)(?: hand)? end$", r"on the \1"),
    (r"\b(?:farthest|furthest|most) (?:to|on) (?:the|your|my) (?=(?:left|right)\b)", "on the "),
    (r"\bmost distant\b", "farthest"),
    (r"\bfa(?:rthest|rther)\b|\bfurthe(?:st|r)\b", "farthest"),
    (r"\bfarthest (?:away|off)\b", "farthest"),
    (rf"\b(nearest|closest|nearer|closer|farthest) {_HERE}\b", r"\1"),
    (r"\bfarthest from (you|yourself|me|us|the robot)\b", r"farthest to \1"),
    # --- what points, and says nothing more
    (r"^(.+?) (?:from |that is |lying |standing |sitting )?(?:right |just )?"
     r"in front of (?:you|me|us)$",
     r"\1"),
    (r"\b(?:over|right) there (?=(?:on|in|inside|under|next to|beside)\b)", ""),
    (r"^(.+) (?:over|right) there$", r"\1"),
    (r"\bback (?=(?:out of|from|off)\b)", ""),
    (r"(?<=\w) (?:over|up|down) (?=(?:on|in|inside|under|next to|beside|there)\b)", " "),
    (r"^((?:that|this|those|these) .+?) (?:over |right )?(?:there|here)$", r"\1"),
    (r"^(.+ (?:on|in|inside|under|next to|beside) .+?) (?:over |right )?(?:there|here)$", r"\1"),
)  # fmt: skip
_BY: Final = re.compile(
    r"(?P<own>.+?)(?: that is)?(?: over| just| right| down)? by (?P<other>(?:the|my|your|that) .+)"
)
_TABLE: Final = tuple((re.compile(pattern), instead) for pattern, instead in _ROWS)


def reworded(text: str, furniture: Mapping[str, str]) -> str:
    """Return a description in plain words; `furniture` are the spoken names of what has a top."""
    text = text.lower().replace("\u2019", "'")
    owned = _owner(tuple(furniture)).fullmatch(text.strip()) if furniture else None
    if owned:
        text = f"{owned['own']} on the {owned['owner']}"
    return _near(" ".join(plain_description(in_plain_words(text)).split()), furniture)


def in_plain_words(text: str) -> str:
    """Return a description, in lower case, in other words that mean the same."""
    for pattern, instead in _TABLE:
        text = pattern.sub(instead, text)
    return " ".join(text.split())


def _near(text: str, furniture: Mapping[str, str]) -> str:
    """Return "the box on the side table" for "the box over by the side table"; next to a thing."""
    found = _BY.fullmatch(text)
    if found is None:
        return text
    named = found["other"].split(maxsplit=1)[-1]
    return f"{found['own']} {'on' if named in furniture else 'next to'} {found['other']}"


_RELATIONS: Final = "on|in|at|of|near|by|next|under|behind|to|from|and|or|that|which|with|over"


@lru_cache(maxsize=8)
def _owner(names: tuple[str, ...]) -> re.Pattern[str]:
    """Return what finds "the side table's cup"; any table goes by the last word of its name.

    A recogniser writes no apostrophe: "the side tables cup", but not "the side tables near you".
    """
    spoken = {*names, *(name.split()[-1] for name in names)}
    owners = "|".join(re.escape(name) for name in sorted(spoken, key=len, reverse=True))
    return re.compile(
        rf"(?:(?:the|my|your|that|this) )?(?P<owner>{owners})"
        rf"(?:'s?|s(?! (?:{_RELATIONS})\b)) (?P<own>.+)"
    )
