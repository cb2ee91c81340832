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


class PhraseVerdict(StrEnum):
    """Name what becomes of what was heard."""

    ACCEPTED = "accepted"
    DOUBTED = "doubted"
    REJECTED = "rejected"
    STOP = "stop"


@dataclass(frozen=True, slots=True, kw_only=True)
class PhraseJudgement:
    """Say what becomes of a phrase, why, and whether asking again may help."""

    verdict: PhraseVerdict
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


def judge(transcript: Transcript, own_words: str, least_confidence: float) -> PhraseJudgement:
    """Return what becomes of words that are no stop, while the robot was saying `own_words`."""
    for why, ask_again in _REFUSALS:
        reason = why(transcript, own_words)
        if reason:
            return PhraseJudgement(
                verdict=PhraseVerdict.REJECTED, reason=reason, ask_again=ask_again
            )
    sure, least = transcript.confidence, least_confidence
    if sure >= least:
        return PhraseJudgement(verdict=PhraseVerdict.ACCEPTED)
    verdict = PhraseVerdict.DOUBTED if sure >= DOUBT_RATIO * least else PhraseVerdict.REJECTED
    reason = f"understood by {sure:.0%}, at least {least:.0%} is needed"
    return PhraseJudgement(verdict=verdict, reason=reason, ask_again=True)


def _without_words(transcript: Transcript, _: str) -> str:
    return "" if words_of(transcript.text) else "a sound without words"


def _courtesy(transcript: Transcript, _: str) -> str:
    return "a courtesy: nothing to do or to answer" if is_courtesy(transcript.text) else ""


def _own_voice(transcript: Transcript, own_words: str) -> str:
    """Know an echo by words in the robot's order: an answer takes up some of them, in its own."""
    words, own = words_of(transcript.text), words_of(own_words)
    blocks = SequenceMatcher(None, own, words, autojunk=False).get_matching_blocks()
    runs = [block.size for block in blocks]
    is_echo = words == own or max(runs) >= OWN_RUN
    return OWN_VOICE if is_echo and sum(runs) > OWN_RATIO * len(words) else ""


def _language(transcript: Transcript, _: str) -> str:
    spoken = transcript.language
    return f"spoken in {spoken}, which is not understood" if transcript.is_foreign else ""


def _made_up(transcript: Transcript, _: str) -> str:
    """Know what networks invent where nobody speaks: they say so, or repeat themselves."""
    if transcript.no_speech > NO_SPEECH:
        return f"nobody spoke, by {transcript.no_speech:.0%}"
    if transcript.compression > MOST_COMPRESSION:
        return f"the text repeats itself, by {transcript.compression:.1f}"
    return ""


_REFUSALS: Final[tuple[tuple[Callable[[Transcript, str], str], bool], ...]] = (
    (_without_words, False),
    (_courtesy, False),
    (_own_voice, False),
    (_language, True),
    (_made_up, False),
)
"""What may be said against a phrase besides doubt, and whether to ask for it again."""
