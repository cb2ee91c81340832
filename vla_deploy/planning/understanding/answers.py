"""Take what is said next as the answer to a question: "the red one", "left", "the second", "no".

never mind, neither                 -> the waiting command is dropped
yes, for a question of yes or no    -> it goes on
words that one candidate alone has  -> that one
not the red one                     -> the one that is left
words that several have, or none    -> not clear: ask once more
words of a candidate among others   -> mixed: ask once more, unless it is a command
words of something else             -> a command of its own
"""

import re
from collections.abc import Sequence
from enum import StrEnum
from typing import Final

from vla_deploy.planning.understanding.conversation import Candidate, Question
from vla_deploy.planning.understanding.phrases import EXTREMES, ORDER_WORDS, ORDINALS, SIDES
from vla_deploy.world.query import ORDERS

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
_NOT: Final = re.compile(
    r"(?:no |any |either |the one )*(?:but not|but|not|except|other than) (?P<rest>.+)"
)
_PLACES: Final = {**ORDINALS, "former": 1, "latter": 2}
"""Places in the row of the candidates, from 1."""
_SILENT_WORDS: Final = (
    "the a an one ones please i mean meant want take pick it is its it's that this that's thing on "
    "in at to of with my your side and uh um er well just give me bring use from yes no rather "
    "other which there over said oh sorry ah hm actually thanks thank you like would think was "
    "then these good for we only going back course into"
)
_SILENT: Final = frozenset(_SILENT_WORDS.split())
"""What says nothing of which one is meant."""
_FILL: Final = frozenset({"the", "one", "on", "in", "a", "an"})
"""Words of the questions themselves, which each candidate has."""
_COMPARING: Final = frozenset(
    {*EXTREMES, *SIDES, *ORDERS, *ORDER_WORDS, *_PLACES, "both", "all", "each", "every", "them",
     "those", "two", "three"}
)  # fmt: skip
"""Words of an answer even where they tell no candidate from the others."""
_WORD: Final = re.compile(r"[a-z0-9_']+")


class AnswerVerdict(StrEnum):
    """Say what an utterance is to a question."""

    YES = "yes"
    NO = "no"
    CHOSEN = "chosen"
    UNCLEAR = "unclear"
    MIXED = "mixed"
    ANEW = "anew"


def judge_answer(question: Question, text: str) -> tuple[AnswerVerdict, Candidate | None]:
    """Return what an utterance is to a question, and the candidate that it picks."""
    said = " ".join(_WORD.findall(text.lower().replace("\u2019", "'")))
    candidates = question.candidates
    if _NO.fullmatch(said):
        return AnswerVerdict.NO, None
    agrees = _YES.fullmatch(said) is not None
    if not candidates:
        return (AnswerVerdict.YES if agrees else AnswerVerdict.ANEW), None
    if _ANY.fullmatch(said) or (agrees and len(candidates) == 1):
        return AnswerVerdict.CHOSEN, candidates[0]
    known = frozenset[str]().union(*({*one.features, one.name} for one in candidates))
    denied = _NOT.fullmatch(said)
    meant = said if denied is None else denied["rest"]
    words = [word for word in meant.split() if word not in _SILENT or word in known - _FILL]
    if agrees and known.isdisjoint(words):  # "right" is the one on the right, where there is one
        return AnswerVerdict.UNCLEAR, None
    if not (known | _COMPARING).issuperset(words):
        return (AnswerVerdict.ANEW if known.isdisjoint(words) else AnswerVerdict.MIXED), None
    fitting = _fitting(candidates, words)
    if denied is not None:
        fitting = [one for one in candidates if one not in fitting] if fitting else []
    return (
        (AnswerVerdict.CHOSEN, fitting[0]) if len(fitting) == 1 else (AnswerVerdict.UNCLEAR, None)
    )


def _fitting(candidates: Sequence[Candidate], words: Sequence[str]) -> list[Candidate]:
    """Return the candidates that words call: by name, by place in the row, by what they are."""
    named = [one for one in candidates if " ".join(words) in (one.name, one.name.replace("_", " "))]
    if named or not words:
        return named
    apart = [word for word in words if not all(word in one.features for one in candidates)]
    if len(apart) == 1 and (place := _PLACES.get(apart[0])) is not None:
        return list(candidates[place - 1 : place] if place > 0 else candidates[place:])
    return [one for one in candidates if one.features.issuperset(words)]
