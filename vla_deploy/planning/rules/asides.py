"""Put what a sentence says aside where it belongs, before it is taken apart at its commas.

the tall bowl, drop the ball in it           -> drop the ball in the tall bowl
take the second cup, counting from the left  -> take the second from the left cup
take a cup, not the red one                  -> take a cup but not the red one
fetch the thing with a green shell, the ball -> fetch the ball with a green shell
take the cup, the blue one                   -> take the blue cup
"""

import re
from collections.abc import Callable, Sequence
from typing import Final

from vla_deploy.planning.asking import Request
from vla_deploy.planning.errors import UnknownObject
from vla_deploy.planning.references import match_place
from vla_deploy.planning.rules.clauses import polite_off
from vla_deploy.planning.understanding.expression import Expression
from vla_deploy.planning.understanding.expressions import read_expression
from vla_deploy.planning.understanding.phrases import HELD, ORDINALS
from vla_deploy.planning.understanding.setting import Setting
from vla_deploy.world.vocabulary import (
    ANY_CLASS,
    ARTICLES,
    COLOURS,
    KIND_WORDS,
    OBJECT_CLASSES,
    SYNONYMS,
)

_COMMA: Final = re.compile(r"\s*(?:[,;:]|\s[-\u2013\u2014]+\s|[.!?](?=\s))\s*")
_ABOUT: Final = re.compile(r"^(?:as for|concerning|regarding|you see) (?=\w)")
_NTH: Final = re.compile(rf"\b(?:{'|'.join(ORDINALS)})\b(?! (?:one )?(?:from|on|to) )")
_COUNTING: Final = re.compile(
    r"(?:(?:if you |when )?(?:counting|counted|count|starting|seen|looking|going)(?: it)? )?"
    r"from (?:the|your|my) (?P<side>left|right)(?: hand)?(?: side| end)?"
)
_NOT: Final = re.compile(
    r"(?:(?:but |just |only )?not|(?:any(?:thing)? )?(?:but|except|other than)) "
    r"(?P<not>(?:the|that|those|these) .+)"
)
_OR: Final = re.compile(r" (?:or|nor) (?:not )?")
_COLOURED: Final = re.compile(rf"(?:the|that) (?:{'|'.join(COLOURS)})$")
_STANDS: Final = re.compile(r"one (?:on|in|by|near|next to|beside|behind|under|closest|nearest)\b")
_OTHER: Final = re.compile(r"(?:but )?(?:rather )?(?:the|that) other(?: one)?")
# "It", where it is no word before another thing: "that one", but not "that cup".
_PRONOUN: Final = re.compile(
    r"\b(?:it|them both|them all|both of them|them|both|that one|this one|those|these|that|this)\b"
    r"(?=$|[.!?]| (?:up|down|in|into|inside|on|onto|to|over|away|here|back|for|with|from|out|off|"
    r"please|now|there)\b)"
)
# "The black one, you put on the table."
_YOU_DO: Final = re.compile(
    r"^you (?:can |should |must |have to |need to )?(?P<do>put|take|bring|leave|place|set) "
    r"(?=(?:on|in|to|onto|into|next|away|down|up|back|over)\b)"
)
_IN_THERE: Final = re.compile(r"\b(?:in|into|inside) there\b")
_THERE: Final = re.compile(r"\b(?:over )?there\b(?=$|[.!?]| please\b)")
_RESTING: Final = re.compile(r"(?<! is)(?<! are)(?<! not) (?:on|in|inside) (?!the (?:left|right))")
_POINTED: Final = re.compile(r" (?:over |right )?(?:there|here)$")
_TAKEN: Final = re.compile(r"(?:pick up|take|grab|get|lift|fetch|hold) ")
_NEXT: Final = re.compile(r"\b(?:and|then)\b")
# What is wanted too is another thing.
_TOO: Final = re.compile(r"\b(?:too|also|as well)\b")
_GENERIC: Final = re.compile(r"\b(?:thing|object|item|(?<=\bthe )one)\b")
_KIND: Final = re.compile(
    rf"\b(?:{KIND_WORDS})e?s?\b"
    r"(?! (?:you|i|we)\b)"
)
_PLAIN: Final = re.compile(rf"\bthe (?P<kind>{_KIND.pattern})")

Pieces = Sequence[str]
Change = Callable[[Pieces, Request], Pieces]


def straightened(text: str, request: Request) -> str:
    """Return a sentence with each aside where it belongs; one without any stays as it is."""
    before = _COMMA.split(text)
    pieces: Pieces = before
    for change in _CHANGES if len(before) > 1 else ():
        pieces = change(pieces, request)
    return text if pieces == before else ", ".join(pieces)


def _counted(pieces: Pieces, _: Request) -> Pieces:
    """Put "counting from the right" behind the "first" that it is about."""
    for at, piece in enumerate(pieces):
        found = _COUNTING.fullmatch(polite_off(piece))
        for near in (at - 1, at + 1) if found else ():
            nth = _NTH.search(pieces[near]) if 0 <= near < len(pieces) else None
            if found and nth:
                told = _behind(pieces[near], nth.end(), f"from the {found['side']}")
                return _without(at, _with(near, told, pieces))
    return pieces


def _left_out(pieces: Pieces, request: Request) -> Pieces:
    """Put "not the red one" behind the thing that it is taken from.

    What is meant may be said as well ("not the red one, the blue one"): then it stands for itself.
    """
    for at in range(1, len(pieces)):
        found = _NOT.fullmatch(polite_off(pieces[at]))
        others = _each_one(found["not"]) if found else ""
        read = _read(others.partition(" or ")[0], request) if found else None
        end = _end_of_noun(read, pieces[at - 1]) if read else None
        if found is None or end is None:
            continue
        following = polite_off(pieces[at + 1]) if at + 1 < len(pieces) else ""
        if _OTHER.fullmatch(following):
            pieces = _without(at + 1, pieces)
        elif _is_thing(following, request):
            return _without(at, _with(at + 1, f"i mean {following}", pieces))
        told = _behind(pieces[at - 1], end, f"but not {others}")
        return _without(at, _with(at - 1, told, pieces))
    return pieces


def _each_one(others: str) -> str:
    """Return "the red one or the purple one" for "the red or the purple one"."""
    return " or ".join(_COLOURED.sub(r"\g<0> one", one) for one in _OR.split(others))


def _named_twice(pieces: Pieces, request: Request) -> Pieces:
    """Let "the thing ..., the book" be the book, and "the cup, the blue one" the blue cup."""
    if _TOO.search(request.text.lower()):
        return pieces
    for at in range(1, len(pieces)):
        second = polite_off(pieces[at])
        read = _read(second, request) if second.split()[:1] == ["the"] else None
        goes_on = at + 1 < len(pieces) and pieces[at + 1].startswith(("the ", "and the "))
        if read is None or read.pronoun or goes_on:
            continue
        first = pieces[at - 1]
        first = _POINTED.sub("", first) if _TAKEN.match(first) else first
        told = _told_once(first, second.split()[1:], read)
        if told:
            return _without(at, _with(at - 1, told, pieces))
    return pieces


def _told_once(first: str, second: Sequence[str], read: Expression) -> str:
    """Return the first words with what the second add; "" where these are another thing."""
    generic = _GENERIC.search(first)
    if generic and len(second) == 1 and read.query.kind != ANY_CLASS:
        return f"{first[: generic.start()]}{second[0]}{first[generic.end() :]}"
    plain = list(_PLAIN.finditer(first))
    if len(plain) != 1 or len(_KIND.findall(first)) != 1:
        return ""
    if _STANDS.match(" ".join(second)):
        return _behind(first, plain[0].end(), " ".join(second[1:]))
    if second[-1] == "one" != second[0]:
        words = " ".join([*second[:-1], plain[0]["kind"]])
        return f"{first[: plain[0].start()]}the {words}{first[plain[0].end() :]}"
    return ""


def _topic(pieces: Pieces, request: Request) -> Pieces:
    """Put what the sentence begins with in the place of the pronoun that takes it up."""
    about = [_ABOUT.sub("", polite_off(piece)) for piece in pieces]
    count = next((at for at, one in enumerate(about) if not _is_thing(one, request)), 0)
    # "The red can in the orange box, then the green one": that is done first.
    if not count or pieces[count].startswith("then "):
        return pieces
    topic, rest = " and ".join(map(_told_from_place, about[:count])), pieces[count]
    rest = _YOU_DO.sub(r"\g<do> it ", rest)
    for pattern, before in ((_IN_THERE, "in "), (_PRONOUN, ""), (_THERE, "to ")):
        found = pattern.search(rest)
        # "Take the ball and put it away": "it" is the ball.
        if found and not _names_another(rest[: found.start()]):
            told = f"{rest[: found.start()]}{before}{topic}{rest[found.end() :]}"
            return [told, *_topic(_others_on(pieces[count + 1 :]), request)]
    return pieces


def _others_on(pieces: Pieces) -> Pieces:
    """Return what follows so that it may begin with a topic of its own: "and the ball, take it"."""
    return [pieces[0].removeprefix("and "), *pieces[1:]] if len(pieces) > 1 else pieces


def _named_after(pieces: Pieces, request: Request) -> Pieces:
    """Put what a sentence ends with in the place of the "it" that went before."""
    second = polite_off(pieces[-1])
    found = re.search(r"\bit\b", pieces[0])
    is_place = match_place(second, request.world.places) is not None
    is_named = second.startswith("the ") and not is_place and _is_one_thing(second, request)
    if (
        len(pieces) != 2
        or found is None
        or not is_named
        or _KIND.search(pieces[0][: found.start()])
    ):
        return pieces
    told = _told_from_place(second)
    return [f"{pieces[0][: found.start()]}{told}{pieces[0][found.end() :]}"]


def _told_from_place(thing: str) -> str:
    """Return "the cup that is on the table": no verb can take that for where to put it."""
    if not _RESTING.search(thing):
        return thing
    return _RESTING.sub(r" that is\g<0>", _POINTED.sub("", thing), count=1)


def _names_another(before: str) -> bool:
    thing = _KIND.search(before)
    return thing is not None and _NEXT.search(before, thing.end()) is not None


def _is_thing(text: str, request: Request) -> bool:
    """Tell whether words are nothing but the names of things or of a place."""
    parts = re.split(r" and ", text)
    return bool(text) and all(_is_one_thing(part, request) for part in parts)


def _is_one_thing(text: str, request: Request) -> bool:
    if match_place(text, request.world.places):
        return True
    read = _read(text, request)
    if read is None:
        return False
    if read.pronoun:
        return read.pronoun == HELD
    return read.query.is_named or text.split()[0] in ARTICLES


def _read(text: str, request: Request) -> Expression | None:
    try:
        return read_expression(text, Setting(request).furniture)
    except UnknownObject:
        return None


def _end_of_noun(read: Expression, clause: str) -> int | None:
    """Return where the thing ends from which others are left out; None where that is not clear."""
    nouns = [(_kind_of(found[0]), found.end()) for found in _KIND.finditer(clause)]
    if read.query.is_named and read.query.kind != ANY_CLASS:
        nouns = [noun for noun in nouns if noun[0] == read.query.kind]
    return nouns[-1][1] if len({kind for kind, _ in nouns}) == 1 else None


def _kind_of(word: str) -> str:
    forms = (word, word.removesuffix("s"), word.removesuffix("es"))
    single = next((one for one in forms if one in OBJECT_CLASSES or one in SYNONYMS), word)
    return SYNONYMS.get(single, single)


def _behind(text: str, at: int, more: str) -> str:
    return f"{text[:at]} {more}{text[at:]}"


def _with(at: int, said: str, pieces: Pieces) -> Pieces:
    return [*pieces[:at], said, *pieces[at + 1 :]]


def _without(at: int, pieces: Pieces) -> Pieces:
    return [*pieces[:at], *pieces[at + 1 :]]


_CHANGES: Final[tuple[Change, ...]] = (_counted, _left_out, _named_twice, _topic, _named_after)
