"""Let what a command tells beside lend to the rest where people are, and what "the larger" is.

"My wife's at the coffee table, take it to her" is to the coffee table; "there are two balls, take
the larger" the larger ball; "leave the book, take the cup" is about the cup alone.
"""

import re
from collections.abc import Sequence
from typing import Final

from vla_deploy.planning.asking import Request
from vla_deploy.planning.references import match_place, words_of
from vla_deploy.planning.rules.building import is_one, is_seen
from vla_deploy.planning.understanding.known_words import single
from vla_deploy.world.vocabulary import COLOURS, KIND_WORDS

POINTS: Final = re.compile(
    r"\b(?:(?:the )?(?:two|three|both|lot) of them|that one|this one|it|them|they|those|(?:that|"
    r"this)(?= (?:goes|belongs|should|needs|can|ought|has|up|over|away|here|out|off|in|on|to|into|"
    r"for)\b)|that(?=$))\b"
)
KIND: Final = re.compile(rf"\b(?:{KIND_WORDS})(?:e?s)?\b")
_ARTICLE: Final = r"(?:the|my|our|your|a|an|that|this|those|these|his|her)"
NAMED: Final = re.compile(
    rf"\b{_ARTICLE} (?:(?!{_ARTICLE}\b)[\w']+ ){{0,3}}?(?:{KIND_WORDS})(?:e?s)?\b"
)
_WHERE: Final = re.compile(
    r"(?:'s|'re| is| are| was| were| must be| should be|)"
    r"(?: (?:lying|sitting|standing|stood|sat|still|over|just|that is|that's|back|up|down))* "
    r"(?P<where>(?:on|in|at|by|inside|under|next to|beside|near|nearest|closest to|nearer to|"
    r"closer to) .+)"
)
_AT_SOMETHING: Final = re.compile(
    r"(?:on|in|at|inside|under|behind) (?P<noun>(?:the|my|our|a|an) (?!way\b|"
    r"same\b)\w+)(?P<more> \w+)?\b.*"
)
_ONE_OF: Final = re.compile(
    r"\b(?:the|that) (?P<which>(?!other\b|only\b|first\b)[\w-]+ )?one(?: (?:over|out|down|up|"
    r"back))?(?P<where> (?:in|on|at|by|next to|beside|near|nearer to|closer to|nearest to|closest "
    r"to) .+?)?(?='s\b| is\b| i\b| was\b|$)"
)
# Somebody who is somewhere: that is where things go that are for them.
_SOMEBODY_AT: Final = re.compile(
    r"(?:and |because |since |as )?(?:there(?:'s| is| are|'ll be| will be) )?"
    r"(?:someone|somebody|an? \w+|(?:my|our) [a-z]+|the (?:guests?|visitors?|kids?|children)|he|"
    r"she|they|we|i)(?:'s|'m|'re| am| is| are|'ll be| will be)?"
    r"(?: (?:sitting|waiting|working|standing|lying|resting|busy|already|just|still|up|down|over))*"
    r" (?:in|at|by|on|near) (?P<place>(?:the|my|our) .+?)"
    r"(?: (?:any (?:minute|moment|second)|now|already))?"
    r"(?: (?:who )?(?:needs?|wants?|is asking for|asked for|would like|could use) (?P<thing>.+))?"
)
_TO_THEM: Final = re.compile(r"\bto (?:her|him|them|us|me)(?: there)?$")
_MEET: Final = re.compile(
    r"(?:go )?(?:and )?(?:meet|greet|see|join|find|welcome|say (?:hello|hi) to) (?:them|him|her|"
    r"us|me)"
)
# "The larger" of the balls that were spoken of.
_OF_A_KIND: Final = re.compile(
    rf"\b(?:the|that) (?P<which>(?:\w+(?:er|est)|{'|'.join(COLOURS)}|left|right|middle|centre|"
    r"center|first|second|third|last|leftmost|rightmost))(?: one)?$"
)
_SEVERAL: Final = re.compile(
    r"(?:there(?:'s| are| is)|i (?:can )?see|you(?:'ve| have)(?: got)?|we(?:'ve| have)(?: got)?|"
    r"(?:can|do) you see) (?:two|three|four|some|a (?:couple|few|pair) (?:of )?|several|both|"
    rf"those|the) (?:\w+ ){{0,2}}?(?P<kind>{KIND_WORDS})e?s?\b.*"
)
_OF_SEVERAL: Final = re.compile(
    r"\b(?:of|there(?:'s| are| is)) (?:the|these|those|my|our|both|two|three|four)"
    r"(?: two| three| four)? "
    rf"(?:\w+ )?(?P<kind>{KIND_WORDS})(?:e?s)?\b"
)
# What stays as it is; nothing that the rest is about.
_LEFT_ALONE: Final = re.compile(
    r"(?:and |but |just )*(?:leave|keep) (?P<thing>(?:the|my|that|this|those|these) .+?) "
    r"(?:where (?:it|they) (?:is|are|lies?|stands?|sits?|belongs?)|alone|be|as (?:it|they) (?:is|"
    r"are)|in peace|right there)"
)


def place_of_people(parts: list[str], request: Request) -> list[str]:
    """Let "take it to her" be to where she is said to be, and "go and meet him" go there."""
    for at, part in enumerate(parts):
        found = _SOMEBODY_AT.fullmatch(part)
        if found is None or match_place(found["place"], request.world.places) is None:
            continue
        there = [_to(found["place"], one) for one in parts]
        if there == parts:
            continue
        rest = there[:at] + there[at + 1 :]
        return rest if found["thing"] is None else [POINTS.sub(found["thing"], rest[0]), *rest[1:]]
    return parts


def _to(place: str, part: str) -> str:
    return f"go to {place}" if _MEET.fullmatch(part) else _TO_THEM.sub(f"to {place}", part)


def kind_lent(parts: list[str]) -> list[str]:
    """Let "the larger" be the larger ball, where only balls were spoken of before."""
    found = _SEVERAL.fullmatch(parts[0]) if len(parts) > 1 else None
    if found is None or NAMED.search(parts[1]):
        return parts
    lent = _OF_A_KIND.sub(rf"the \g<which> {found['kind']}", parts[1])
    return parts if lent == parts[1] else [lent, *parts[2:]]


def left_alone_off(parts: list[str], request: Request) -> list[str]:
    """Leave out what stays as it is, beside what is to be done with other things."""
    kept = [part for part in parts if not _LEFT_ALONE.fullmatch(part)]
    left = [found["thing"] for part in parts if (found := _LEFT_ALONE.fullmatch(part))]
    if not kept or not left or not all(is_one(one, request) for one in left):
        return parts
    nouns = {found[0] for one in left for found in KIND.finditer(one)}
    return parts if any(nouns & set(words_of(part)) for part in kept) else kept


def kinds_told(told: Sequence[str]) -> set[str]:
    """Return the kinds of things that parts of a command name, in the singular."""
    return {single(found[0]) for part in told for found in KIND.finditer(part)}


def things_told(told: Sequence[str], request: Request) -> list[str]:
    """Return the things that parts of a command name; the last is the likeliest to be meant.

    Of "there are two cups, the left one is empty" it is the left cup alone.
    """
    kinds = {single(found["kind"]) for part in told for found in _OF_SEVERAL.finditer(part)}
    kinds = kinds or kinds_told(told)
    ones = [found for part in told for found in _ONE_OF.finditer(part)] if len(kinds) == 1 else []
    if ones:
        kind = next(iter(kinds))
        return [f"the {ones[-1]['which'] or ''}{kind}{ones[-1]['where'] or ''}"]
    return list(dict.fromkeys(thing for part in told for thing in _things(part, request)))


def _things(part: str, request: Request) -> list[str]:
    """Return the things that a part names; where the last is makes it no further one."""
    told = list[str]()
    for found in NAMED.finditer(part):
        where = _WHERE.fullmatch(part, found.end())
        if where is not None and _is_nowhere(where["where"], request):
            break
        whole = "" if where is None else f"{found[0]} {where['where']}"
        is_known = bool(whole) and is_one(whole, request) and is_seen(whole, request)
        told.append(whole if is_known else found[0])
        if where is not None:
            break
    return [re.sub(rf"^{_ARTICLE} ", "the ", one) for one in told]


def _is_nowhere(where: str, request: Request) -> bool:
    """Tell whether something is on or in what the robot does not know."""
    found = _AT_SOMETHING.fullmatch(where)
    nouns = () if found is None else (found["noun"], f"{found['noun']}{found['more'] or ''}")
    return bool(nouns) and not any(is_one(noun, request) for noun in nouns)
