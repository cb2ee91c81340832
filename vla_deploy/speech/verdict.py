"""Decide what becomes of a phrase: a command for the planner, or nothing, with the reason.

The first row of `_REFUSALS` that says something decides; it is told in `heard`. What is only not
sure enough is doubted: the planner asks whether it is meant if it makes sense there.
"""

from collections.abc import Callable
from dataclasses import dataclass
from difflib import SequenceMatcher
from enum import StrEnum
from typing import Final

from vla_deploy.speech.phrases import Phrase
from vla_deploy.speech.reading import Reading
from vla_deploy.speech.words import is_courtesy, words_of

FASTEST_WORDS_S: Final = 7.0
MOST_COMPRESSION: Final = 2.4
NO_SPEECH: Final = 0.8
SURE_VOICE: Final = 0.7
CLIPPED_RATIO: Final = 0.01
OWN_RUN: Final = 4
OWN_RATIO: Final = 0.7
"""The robot's own are so many of its words in a row, and all in all so many of the phrase's."""
DOUBT_RATIO: Final = 0.5
"""What is understood by this share of what is needed may still make sense to the planner."""


class Verdict(StrEnum):
    """Name what becomes of what was heard."""

    ACCEPTED = "accepted"
    DOUBTED = "doubted"
    REJECTED = "rejected"
    STOP = "stop"


@dataclass(frozen=True, slots=True, kw_only=True)
class Case:
    """Hold all that a phrase is judged by."""

    reading: Reading
    phrase: Phrase
    confidence: float
    least_confidence: float
    languages: tuple[str, ...]
    music: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class Judgement:
    """Say what becomes of a phrase, why, and whether asking again may help."""

    verdict: Verdict
    reason: str = ""
    ask_again: bool = False


@dataclass(frozen=True, slots=True)
class _Refusal:
    why: Callable[[Case], str]
    ask_again: bool
    by_sound: bool = True
    """Whether an overdriven microphone may be the cause."""
    may_be_doubt: bool = False
    """Whether what is nearly good enough is for the planner to make sense of."""


def judge(case: Case) -> Judgement:
    """Return what becomes of a phrase that is no stop."""
    for row in _REFUSALS:
        reason = row.why(case)
        if reason:
            reason += _OVERDRIVEN if row.by_sound and _is_overdriven(case) else ""
            is_doubted = row.may_be_doubt and _may_make_sense(case)
            verdict = Verdict.DOUBTED if is_doubted else Verdict.REJECTED
            return Judgement(verdict=verdict, reason=reason, ask_again=row.ask_again)
    return Judgement(verdict=Verdict.ACCEPTED)


def _without_words(case: Case) -> str:
    return "" if words_of(case.reading.text) else "a sound without words"


def _courtesy(case: Case) -> str:
    return "a courtesy: nothing to do, nothing to answer" if is_courtesy(case.reading.text) else ""


def _own_voice(case: Case) -> str:
    """Know an echo by words in the robot's order: an answer takes up some of them, in its own."""
    words, own = words_of(case.reading.text), words_of(case.phrase.own_words)
    blocks = SequenceMatcher(None, own, words, autojunk=False).get_matching_blocks()
    runs = [block.size for block in blocks]
    is_echo = words == own or max(runs) >= OWN_RUN
    return "the robot heard itself" if is_echo and sum(runs) > OWN_RATIO * len(words) else ""


def _music(case: Case) -> str:
    unsure = case.phrase.voice < SURE_VOICE
    return "music, or another sound with a steady pitch" if case.music and unsure else ""


def _language(case: Case) -> str:
    spoken = case.reading.language
    if spoken in case.languages:
        return ""
    return f"spoken in {spoken}, but only {', '.join(case.languages)} is understood"


def _too_fast(case: Case) -> str:
    words_s = len(words_of(case.reading.text)) / max(case.phrase.voiced_s, 0.1)
    if words_s <= FASTEST_WORDS_S or case.phrase.voiced_s < 0.3:
        return ""
    return f"{words_s:.0f} words a second were read, at most {FASTEST_WORDS_S:.0f} can be said"


def _repeats(case: Case) -> str:
    ratio = case.reading.compression
    if ratio <= MOST_COMPRESSION:
        return ""
    return f"the text repeats itself (compression {ratio:.1f}, at most {MOST_COMPRESSION})"


def _nobody(case: Case) -> str:
    probability = case.reading.no_speech
    return f"nobody spoke, by {probability:.0%}" if probability > NO_SPEECH else ""


def _unsure(case: Case) -> str:
    if case.confidence >= case.least_confidence:
        return ""
    return f"understood by {case.confidence:.0%}, at least {case.least_confidence:.0%} is needed"


def _may_make_sense(case: Case) -> bool:
    return case.confidence >= DOUBT_RATIO * case.least_confidence


_OVERDRIVEN: Final = (
    "; the microphone is overdriven: turn its gain down, or speak from farther away"
)


def _is_overdriven(case: Case) -> bool:
    return case.phrase.clipped_ratio > CLIPPED_RATIO


_REFUSALS: Final = (
    _Refusal(_without_words, ask_again=False),
    _Refusal(_courtesy, ask_again=False, by_sound=False),
    _Refusal(_own_voice, ask_again=False, by_sound=False),
    _Refusal(_music, ask_again=False),
    _Refusal(_language, ask_again=True),
    _Refusal(_nobody, ask_again=False),
    _Refusal(_repeats, ask_again=False),
    _Refusal(_too_fast, ask_again=False),
    _Refusal(_unsure, ask_again=True, may_be_doubt=True),
)
