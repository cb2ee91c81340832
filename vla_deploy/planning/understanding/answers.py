"""Take what is said next as the answer to a question: "the red one", "left", "the second", "no".

words of something else               -> a command of its own
never mind, neither                   -> the waiting command is dropped
yes, for a question of yes or no      -> it goes on
words that one candidate alone has    -> that one
not the red one                       -> the one that is left
words that several have, or none      -> not clear: ask once more

A word that no candidate has, and that is not listed as saying nothing, makes it no answer.
"""

import re
from enum import StrEnum
from typing import Final

from vla_deploy.planning.understanding.conversation import Candidate, Question
from vla_deploy.planning.understanding.expressions import known_words
from vla_deploy.planning.understanding.phrases import (
    EXTREMES,
    NUMBERS,
    ORDER_WORDS,
    ORDINALS,
    SIDES,
    from_side,
)
from vla_deploy.world.query import ORDERS
from vla_deploy.world.vocabulary import ARTICLES, KIND_WORDS

Candidates = tuple[Candidate, ...]

_NO: Final = re.compile(
    r"(?:no|nope|nah|never ?mind|forget (?:it|about it|that)|cancel|neither|none|nothing|"
    r"not now|don'?t|do not|leave it|no thanks?|no thank you|"
    r"(?:none|neither) of (?:them|those|these|the (?:two|three|four)))"
    r"(?: (?:one|please|thanks|thank you))*"
)
_YES: Final = re.compile(
    r"(?:yes|yeah|yep|yup|sure|ok|okay|right|correct|exactly|of course|please do|do it|do that|"
    r"go now|go|now|go ahead|go on|confirm(?:ed)?|affirmative|that'?s right|that is right)"
    r"(?: (?:please|now|go|do it|do that|do|go ahead|that one|that'?s right))*"
)
_ANY: Final = re.compile(
    r"(?:either|any|whichever|any one|anyone|i don'?t care|(?:it )?doesn'?t matter|you choose|your "
    r"choice|whatever)(?: (?:one|of them|will do|is fine))*"
)
# Several, where one was asked for: no other command, and nothing that could be gone on with.
_ALL: Final = re.compile(r"(?:both|all|each|every one)(?: (?:of (?:them|those|these)|two|three))*")
_PLACES: Final = {**ORDINALS, "former": 1, "latter": 2}
"""Places in the row of the candidates, from 1."""
_SILENT_WORDS: Final = (
    "the a an one ones please i mean meant want take pick it is its it's that this that's thing on "
    "in at to of with my your side and uh um er well just give me bring use from yes no rather "
    "other which there over said oh sorry ah hm actually thanks thank you like would think was "
    "then two three those these good for them we only going back course"
)
_SILENT: Final = frozenset(_SILENT_WORDS.split())
"""What says nothing of which one is meant."""
_FILL: Final = frozenset({"the", "one", "on", "in", "a", "an"})
"""Words of the questions themselves, which each candidate has."""
_COMPARING: Final = frozenset({*EXTREMES, *SIDES, *ORDERS, *ORDER_WORDS, *ORDINALS})
"""Words of an answer even where they tell no candidate from the others."""
_WORD: Final = re.compile(r"[a-z0-9_']+")
_TO: Final = re.compile(r"^(?:(?:go |back |over )*(?:to|into|in|at|on|by) )?(?:(?:the|my|your) )?")
_PIECE: Final = re.compile(r"\s*(?:[,;.!?]|\s-+\s)\s*")
_NOT: Final = re.compile(
    r"(?:no |any |either |the one )*(?:but not|but|not|except|other than|"
    r"(?:that |which )?is(?:n't| not)|(?:you can )?(?:leave|keep)|"
    r"i (?:don't|do not) (?:want|mean)) (?P<not>.+?)(?: alone| where it is)?"
)
_FROM_SIDE: Final = re.compile(
    rf"\b({'|'.join(ORDINALS)})(?: one)? (?:from|on) (?:the )?(left|right)\b"
)
_DENIES: Final = re.compile(
    r"\b(?:not|no|never|neither|nor|but|except|where|why|how|who|avoid|instead|without|hardly|"
    r"forget|hate|wrong|out|if|when|later|tomorrow|do you|are you|leave|keep)\b|n't\b|"
    r"^(?:is|are|was|does|did|what)\b"
)


class Verdict(StrEnum):
    """Say what an utterance is to a question."""

    YES = "yes"
    NO = "no"
    CHOSEN = "chosen"
    UNCLEAR = "unclear"
    ANEW = "anew"


def guess(question: Question, text: str) -> Candidate | None:
    """Return the one candidate that an answer calls, whatever else it says: "the green, my oil".

    None where a word of it could mean another thing. Ask first whether it is a command, and read it
    back.
    """
    said = " ".join(_WORD.findall(_plain(text)))
    if _DENIES.search(said) or text.strip().endswith("?"):
        return None
    words = _telling(question.candidates, said)
    known = _known(question.candidates) | _COMPARING
    told = [word for word in words if word in known]
    if not told or not (known_words() - ARTICLES).isdisjoint({*words} - known):
        return None
    fitting = [one for one in question.candidates if one.features.issuperset(told)]
    return fitting[0] if len(fitting) == 1 else None


def judge_answer(question: Question, text: str) -> tuple[Verdict, Candidate | None]:
    """Return what an utterance is to a question, and the candidate that it picks."""
    said = " ".join(_WORD.findall(_plain(text)))
    if _NO.fullmatch(said):
        return Verdict.NO, None
    agrees = _YES.fullmatch(said) is not None
    if not question.candidates:
        return (Verdict.YES if agrees else Verdict.ANEW), None
    if _ANY.fullmatch(said) or (agrees and len(question.candidates) == 1):
        return Verdict.CHOSEN, question.candidates[0]
    if _ALL.fullmatch(said):
        return Verdict.UNCLEAR, None
    verdict, chosen = _among(question.candidates, text)
    # "right" is the one on the right where there is one; of several a yes picks none.
    return (Verdict.UNCLEAR if agrees and verdict is Verdict.ANEW else verdict), chosen


def _plain(text: str) -> str:
    return text.lower().replace("\u2019", "'")


def _among(candidates: Candidates, text: str) -> tuple[Verdict, Candidate | None]:
    """Pick a candidate; what is said not to be meant is left out."""
    left, rest = candidates, list[str]()
    for piece in _PIECE.split(_plain(text)):
        said = " ".join(_WORD.findall(piece))
        denied = _NOT.fullmatch(said)
        if denied is None:
            rest.append(said)
            continue
        words = _telling(candidates, denied["not"])
        if not words or not _known(candidates).issuperset(words):
            return Verdict.ANEW if words else Verdict.UNCLEAR, None
        left = tuple(one for one in left if not one.features.issuperset(words))
    said = " ".join(filter(None, rest))
    if len(left) == 1 < len(candidates) and not _telling(candidates, said):
        return Verdict.CHOSEN, left[0]
    return _picked(left, said) if left else (Verdict.NO, None)


def _picked(candidates: Candidates, said: str) -> tuple[Verdict, Candidate | None]:
    called = (said, _TO.sub("", said))
    by_name = [one for one in candidates if {one.name, one.name.replace("_", " ")} & {*called}]
    if len(by_name) == 1:
        return Verdict.CHOSEN, by_name[0]
    words = _telling(candidates, said)
    place = _place_of(candidates, said, words)
    if place is not None:
        in_row = place <= len(candidates)
        at = place - 1 if place > 0 else place
        return (Verdict.CHOSEN, candidates[at]) if in_row else (Verdict.UNCLEAR, None)
    if not words:
        return Verdict.UNCLEAR, None
    if not (_known(candidates) | _COMPARING).issuperset(words):
        return Verdict.ANEW, None
    fitting = [one for one in candidates if one.features.issuperset(words)]
    return (Verdict.CHOSEN, fitting[0]) if len(fitting) == 1 else (Verdict.UNCLEAR, None)


def _known(candidates: Candidates) -> frozenset[str]:
    return frozenset[str]().union(*(one.features for one in candidates))


def _telling(candidates: Candidates, said: str) -> list[str]:
    """Return the words of an answer that may tell candidates apart."""
    known = _known(candidates)
    said = _FROM_SIDE.sub(lambda found: from_side(found[1], found[2]), said)
    return [word for word in said.split() if word not in _SILENT or word in known - _FILL]


def _place_of(candidates: Candidates, said: str, words: list[str]) -> int | None:
    """Return the place in the row that "the second" or "number two" names, or None."""
    number = re.fullmatch(r"(?:the )?(?:number|option) (\w+)", said)
    if number:
        return NUMBERS.get(number[1])
    apart = [word for word in words if not all(word in one.features for one in candidates)]
    return _PLACES.get(apart[0]) if len(apart) == 1 else None


# --- an answer by another thing -----------------------------------------------------------------

_WHERE: Final = re.compile(
    r"(?:(?:no|yes|well|oh|sorry|it(?:'s| is)|i (?:mean|meant|want|said)|take) )*"
    r"(?:the|that) (?P<which>[a-z]+ )??(?:one|(?P<noun>[a-z]+)) (?:(?:that|which)(?:'s| is) )?"
    r"(?P<where>(?:over )?(?:next to|close to|beside|behind|in front of|near|nearest(?: to)?|"
    r"closest to|by|under|on top of|(?:to the )?(?:left|right) of|inside|in|on) .+?)"
    r"(?: (?:please|then|thanks))*"
)
_KIND: Final = re.compile(rf"\b(?:{KIND_WORDS})\b")


def described(question: Question, text: str) -> str | None:
    """Return the waiting command in full where an answer says by which other thing one stands.

    "the one next to the book", to "pick up the cup" -> "pick up the cup next to the book".
    """
    found = _WHERE.fullmatch(" ".join(_WORD.findall(_plain(text))))
    expression, command = question.expression, question.command_text
    if found is None or not question.candidates or not expression:
        return None
    if found["noun"] and found["noun"] not in expression.split():
        return None
    noun = _KIND.search(expression)
    # "The ball from the table" may have been said as "lift the ball up off the table".
    spelt = (expression, *(() if noun is None else (f"the {noun[0]}",)))
    found_in = [list(re.finditer(rf"\b{re.escape(it)}\b", command, re.IGNORECASE)) for it in spelt]
    named = next((one for one in found_in if one), [])
    if len(named) != 1:
        return None
    start, end = named[0].span()
    which = found["which"] or ""
    return f"{command[:start]}{which}{command[start:end]} {found['where']}{command[end:]}"
