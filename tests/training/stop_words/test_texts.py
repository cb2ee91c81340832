"""Nothing that is to be left alone holds a stop word, and every phrase with one holds just that."""

import numpy as np
import pytest

from training.stop_words.stop_phrases import stop_phrases
from training.stop_words.texts import WORDS, Other, is_clean, other_talk


@pytest.mark.parametrize(
    "text", ["stop", "the bus stop", "doorstop", "Halt!", "she frees it", "stawp"]
)
def test_what_sounds_like_a_stop_word_is_not_clean(text: str) -> None:
    assert not is_clean(text)


@pytest.mark.parametrize("text", ["he stopped", "stops", "stopping", "halted", "freezer", "frozen"])
def test_forms_of_a_stop_word_are_clean(text: str) -> None:
    assert is_clean(text)


def test_other_talk_is_clean_and_as_much_as_asked_for() -> None:
    words = ["apple", "doorstop", "stopgap"]
    example = Other(text="rein a horse", is_ordinary=True)
    talk = other_talk(300, np.random.default_rng(0), words, lambda _: example)
    assert len(talk) == 300
    assert example in talk
    assert all(is_clean(one.text) for one in talk)
    assert 0.5 < np.mean([one.is_ordinary for one in talk]) < 0.8


@pytest.mark.parametrize("word", WORDS)
def test_phrases_say_whether_their_word_comes_last(word: str) -> None:
    phrases = stop_phrases(word)
    assert len({text for text, _ in phrases}) == len(phrases)
    for text, is_last in phrases:
        assert is_last == text.rstrip("!?.").endswith(word)
        assert not any(other in text for other in WORDS if other != word)
