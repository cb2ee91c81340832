"""Take what is said next as the answer to a question: "the red one", "left", "the second", "no".

expired, or words of something else   -> a command of its own
never mind                            -> the waiting command is dropped
yes, for a question of yes or no      -> it goes on
words that one candidate alone has    -> that one
words that several have, or none      -> not clear: ask once more
"""

import re
from dataclasses import dataclass, replace
from enum import StrEnum
from typing import Final

from vla_deploy.planning.understanding.conversation import Candidate, Conversation, Question


class Verdict(StrEnum):
    """Say what an utterance is to a question."""

    YES = "yes"
    NO = "no"
    CHOSEN = "chosen"
    UNCLEAR = "unclear"
    ANEW = "anew"


@dataclass(frozen=True, slots=True, kw_only=True)
class Reply:
    """Say how an utterance goes on: `text` is what to plan, by `conversation`.

    `chosen` is the candidate that was picked. With the verdicts NO and UNCLEAR nothing is planned.
    """

    verdict: Verdict
    text: str
    conversation: Conversation
    chosen: Candidate | None = None


NO_WORDS: Final = re.compile(
    r"(?:no|nope|nah|never ?mind|forget (?:it|about it|that)|cancel|neither|none|nothing|"
    r"don'?t|do not|leave it|none of (?:them|those)|no thanks?|no thank you)(?: (?:one|please))?"
)
YES_WORDS: Final = re.compile(
    r"(?:yes|yeah|yep|yup|sure|ok|okay|right|correct|exactly|of course|please do|do it|do that|"
    r"go ahead|go on|confirm(?:ed)?|affirmative|that'?s right|that is right)"
    r"(?: (?:please|do it|do that|do|go ahead|that one|that'?s right))*"
)
ANY_WORDS: Final = re.compile(
    r"(?:either|any|whichever|any one|anyone|i don'?t care|doesn'?t matter|"
    r"it doesn'?t matter|you choose|your choice|whatever)(?: (?:one|of them|will do|is fine))*"
)
ORDINALS: Final = {
    "first": 0, "1st": 0, "former": 0, "second": 1, "2nd": 1, "latter": 1, "third": 2, "3rd": 2,
    "fourth": 3, "4th": 3, "fifth": 4, "last": -1,
}  # fmt: skip
NUMBERS: Final = {"one": 0, "two": 1, "three": 2, "four": 3, "five": 4,
                  "1": 0, "2": 1, "3": 2, "4": 3, "5": 4}  # fmt: skip
# What says nothing of which one is meant.
_SILENT: Final = frozenset(
    {
        "the", "a", "an", "one", "ones", "please", "i", "mean", "meant", "want", "take", "pick",
        "it", "is", "its", "that", "this", "thing", "on", "in", "at", "to", "of", "with", "my",
        "your", "side", "and", "uh", "um", "er", "well", "just", "give", "me", "bring", "use",
        "from", "yes", "no", "not", "rather",
    }
)  # fmt: skip
# Words of the questions themselves.
_FILL: Final = frozenset({"the", "one", "on", "in", "a", "an"})
_WORD: Final = re.compile(r"[a-z0-9_']+")


def reply(conversation: Conversation, text: str, now_ns: int) -> Reply:
    """Read an utterance in the light of the question that waits, if one does."""
    question = conversation.question
    free = conversation.settled()
    if question is None or not question.is_open(now_ns):
        return Reply(verdict=Verdict.ANEW, text=text, conversation=free)
    verdict, chosen = judge_answer(question, text)
    if verdict is Verdict.ANEW:
        return Reply(verdict=verdict, text=text, conversation=free)
    if verdict is Verdict.UNCLEAR:
        again = replace(conversation, question=replace(question, asked_ns=now_ns))
        return Reply(verdict=verdict, text=question.command_text, conversation=again)
    choices = dict(question.choices)
    if chosen is not None:
        choices[question.expression] = chosen.name
    return Reply(
        verdict=verdict,
        text=question.command_text,
        conversation=conversation.settled(choices),
        chosen=chosen,
    )


def judge_answer(question: Question, text: str) -> tuple[Verdict, Candidate | None]:
    """Return what an utterance is to a question, and the candidate that it picks."""
    said = " ".join(_WORD.findall(text.lower()))
    if NO_WORDS.fullmatch(said):
        return Verdict.NO, None
    if not question.candidates:
        return (Verdict.YES if YES_WORDS.fullmatch(said) else Verdict.ANEW), None
    if ANY_WORDS.fullmatch(said):
        return Verdict.CHOSEN, question.candidates[0]
    agrees = YES_WORDS.fullmatch(said) is not None
    if agrees and len(question.candidates) == 1:
        return Verdict.CHOSEN, question.candidates[0]
    verdict, chosen = _picked(question.candidates, said)
    # "right" is the one on the right where there is one; of several a yes picks none.
    return (Verdict.UNCLEAR if agrees and verdict is Verdict.ANEW else verdict), chosen


def _picked(candidates: tuple[Candidate, ...], said: str) -> tuple[Verdict, Candidate | None]:
    by_name = [one for one in candidates if said == one.name]
    if len(by_name) == 1:
        return Verdict.CHOSEN, by_name[0]
    known = frozenset[str]().union(*(one.features for one in candidates))
    words = [word for word in said.split() if word not in _SILENT or word in known - _FILL]
    place = _place_of(said, words)
    if place is not None:
        in_row = place < len(candidates)
        return (Verdict.CHOSEN, candidates[place]) if in_row else (Verdict.UNCLEAR, None)
    if not words:
        return Verdict.UNCLEAR, None
    if any(word not in known for word in words):
        return Verdict.ANEW, None
    fitting = [one for one in candidates if one.features.issuperset(words)]
    return (Verdict.CHOSEN, fitting[0]) if len(fitting) == 1 else (Verdict.UNCLEAR, None)


def _place_of(said: str, words: list[str]) -> int | None:
    """Return the place in the row that "the second" or "number two" names, or None."""
    if len(words) == 1 and words[0] in ORDINALS:
        return ORDINALS[words[0]]
    number = re.fullmatch(r"(?:the )?(?:number|option) (\w+)", said)
    return NUMBERS.get(number[1]) if number else None
