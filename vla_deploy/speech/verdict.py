"""Decide what becomes of a phrase: a stop, a command for the planner, or nothing, with the reason.

A stop is decided first, and by the words alone. Of what is no stop the first row of `_REFUSALS`
that says something decides; it is told in `heard`. What is only not sure enough is doubted: the
planner asks whether it is meant if it makes sense there.
"""

from collections.abc import Callable, Set
from dataclasses import dataclass
from difflib import SequenceMatcher
from enum import StrEnum
from typing import Final

from vla_deploy.speech.transcript import Transcript
from vla_deploy.speech.words import STOPS, holds_stop, is_courtesy, is_stop, words_of

STOP_CONFIDENCE: Final = 0.25
"""A phrase of nothing but stop words stops the robot from here on, whatever any network says."""
STOP_WITHIN_CONFIDENCE: Final = 0.5
"""The same, of a stop word among others: below that, other talk is often misread as one."""
MOST_COMPRESSION: Final = 2.4
NO_SPEECH: Final = 0.8
OWN_RUN: Final = 4
OWN_RATIO: Final = 0.7
"""The robot's own are so many of its words in a row, and all in all so many of the phrase's."""
DOUBT_RATIO: Final = 0.5
"""What is understood by this share of what is needed may still make sense to the planner."""
OWN_VOICE: Final = "the robot heard itself"


class Verdict(StrEnum):
    """Name what becomes of what was heard."""

    ACCEPTED = "accepted"
    DOUBTED = "doubted"
    REJECTED = "rejected"
    STOP = "stop"


@dataclass(frozen=True, slots=True, kw_only=True)
class Case:
    """Hold all that a phrase is judged by; `own_words` are what the robot was saying."""

    transcript: Transcript
    own_words: str = ""
    confidence: float
    least_confidence: float
    languages: tuple[str, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class Judgement:
    """Say what becomes of a phrase, why, and whether asking again may help."""

    verdict: Verdict
    reason: str = ""
    ask_again: bool = False


def stops(text: str, confidence: float, own_words: str = "", names: Set[str] = frozenset()) -> bool:
    """Return whether words that were read stop the robot; `names` are those it answers to.

    The word itself does, whatever is meant by it: a stop too many does no harm. Only a stop word
    that the robot was just saying itself is none.
    """
    if not STOPS.isdisjoint(words_of(own_words)):
        return False
    if is_stop(text, names):
        return confidence >= STOP_CONFIDENCE
    return holds_stop(text) and confidence >= STOP_WITHIN_CONFIDENCE


def judge(case: Case) -> Judgement:
    """Return what becomes of a phrase that is no stop."""
    for why, ask_again in _REFUSALS:
        reason = why(case)
        if reason:
            return Judgement(verdict=Verdict.REJECTED, reason=reason, ask_again=ask_again)
    sure, least = case.confidence, case.least_confidence
    if sure >= least:
        return Judgement(verdict=Verdict.ACCEPTED)
    verdict = Verdict.DOUBTED if sure >= DOUBT_RATIO * least else Verdict.REJECTED
    reason = f"understood by {sure:.0%}, at least {least:.0%} is needed"
    return Judgement(verdict=verdict, reason=reason, ask_again=True)


def _without_words(case: Case) -> str:
    return "" if words_of(case.transcript.text) else "a sound without words"


def _courtesy(case: Case) -> str:
    is_one = is_courtesy(case.transcript.text)
    return "a courtesy: nothing to do, nothing to answer" if is_one else ""


def _own_voice(case: Case) -> str:
    """Know an echo by words in the robot's order: an answer takes up some of them, in its own."""
    words, own = words_of(case.transcript.text), words_of(case.own_words)
    blocks = SequenceMatcher(None, own, words, autojunk=False).get_matching_blocks()
    runs = [block.size for block in blocks]
    is_echo = words == own or max(runs) >= OWN_RUN
    return OWN_VOICE if is_echo and sum(runs) > OWN_RATIO * len(words) else ""


def _language(case: Case) -> str:
    spoken = case.transcript.language
    if spoken in case.languages:
        return ""
    return f"spoken in {spoken}, but only {', '.join(case.languages)} is understood"


def _made_up(case: Case) -> str:
    """Know what networks invent where nobody speaks: they say so, or repeat themselves."""
    no_speech, compression = case.transcript.no_speech, case.transcript.compression
    if no_speech > NO_SPEECH:
        return f"nobody spoke, by {no_speech:.0%}"
    if compression > MOST_COMPRESSION:
        return (
            f"the text repeats itself, compression {compression:.1f} of {MOST_COMPRESSION} at most"
        )
    return ""


_REFUSALS: Final[tuple[tuple[Callable[[Case], str], bool], ...]] = (
    (_without_words, False),
    (_courtesy, False),
    (_own_voice, False),
    (_language, True),
    (_made_up, False),
)
"""What may be said against a phrase besides doubt, and whether to ask for it again."""
