"""Stops for the training stand alone, in phrases and amid other words, but not amid their forms."""

from collections import Counter

import numpy as np
import pytest

from training.stop_words.stop_phrases import stop_phrases
from training.stop_words.stop_texts import (
    ALONE_SHARE,
    AMID_TALK_SHARE,
    StopText,
    stop_texts,
)
from training.stop_words.texts import WORDS
from training.stop_words.timing import can_be_timed

TALK = ("he stopped at the freezer", "halting steps", "the red door", "rain on Monday")
COUNT = 1000


def drawn(timed: bool) -> list[StopText]:
    return stop_texts(COUNT, TALK, np.random.default_rng(0), timed=timed)


@pytest.mark.parametrize("timed", [False, True])
def test_each_says_its_word_and_whether_it_comes_last(timed: bool) -> None:
    for text, word, is_last in drawn(timed):
        assert word in text.lower()
        assert is_last == text.rstrip("!?.").endswith(word)
        assert timed or can_be_timed(text, word, is_last=is_last)


def test_as_many_as_told_stand_alone_and_amid_words_of_the_talk() -> None:
    phrases = {text for word in WORDS for text, _ in stop_phrases(word)}
    kinds = Counter(
        "alone" if text == word else "phrase" if text in phrases else "amid"
        for text, word, _ in drawn(timed=True)
    )
    assert abs(kinds["amid"] / COUNT - AMID_TALK_SHARE) < 0.05
    assert kinds["alone"] / COUNT > ALONE_SHARE - 0.05
    assert kinds["phrase"] / COUNT > 0.2


def test_no_form_of_a_stop_word_stands_beside_one() -> None:
    texts = " ".join(text for text, _, _ in drawn(timed=True))
    assert "door" in texts
    assert "Monday" in texts
    assert not any(form in texts for form in ("stopped", "freezer", "halting"))
