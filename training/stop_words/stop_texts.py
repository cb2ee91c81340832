"""Draw the texts with a stop word that are spoken for the training."""

from collections.abc import Sequence
from typing import Final

import numpy as np

from training.stop_words.amid_talk import amid_talk
from training.stop_words.picking import pick
from training.stop_words.stop_phrases import stop_phrases
from training.stop_words.texts import WORDS
from training.stop_words.timing import can_be_timed

ALONE_SHARE: Final = 0.2
AMID_TALK_SHARE: Final = 0.4
"""Of the texts: nothing but the word, and the word amid any other words; the rest are phrases."""
_PLACES: Final = ((True, False), (True, False), (False, True), (True, True))
"""Whether words come before it and after it; the last only where each word can be timed."""
StopText = tuple[str, str, bool]


def stop_texts(
    count: int, talk: Sequence[str], random: np.random.Generator, *, timed: bool
) -> list[StopText]:
    """Return texts, their word, and whether it comes last; words of the `talk` stand around some.

    Without `timed` the engine tells no times: then the word comes first or last.
    """
    # In "stopped" are the sounds of a stop word, and where they are tells nobody which was said.
    plain = [text for text in talk if not any(word in text.lower() for word in WORDS)]
    places = _PLACES if timed else _PLACES[:-1]
    phrases = {word: _phrases(word, timed=timed) for word in WORDS}

    def text_with(word: str) -> StopText:
        share = random.random()
        if share < ALONE_SHARE:
            return word, word, True
        if share < ALONE_SHARE + AMID_TALK_SHARE:
            before, after = pick(places, random)
            return amid_talk(word, random, plain, before=before, after=after), word, not after
        return pick(phrases[word], random)

    return [text_with(WORDS[n % len(WORDS)] if n % 2 else WORDS[0]) for n in range(count)]


def _phrases(word: str, *, timed: bool) -> list[StopText]:
    return [
        (text, word, is_last)
        for text, is_last in stop_phrases(word)
        if timed or can_be_timed(text, word, is_last=is_last)
    ]
