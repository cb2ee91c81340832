"""A stop word that the search never followed is asked about, in place of each word that it read."""

import math
from collections.abc import Callable, Sequence

import pytest

from vla_deploy.speech.stop_odds import ASKED_FROM, MOST_WORDS, stop_odds, with_stop
from vla_deploy.speech.stopping import STOP_WITNESSES


def told(likely: dict[str, float], other: float = -9.0) -> Callable[[Sequence[str]], list[float]]:
    return lambda texts: [likely.get(text, other) for text in texts]


def test_a_stop_word_stands_for_each_word_with_its_comma() -> None:
    assert with_stop("hey, hold") == [
        "freeze, hold", "halt, hold", "stop, hold", "hey, freeze", "hey, halt", "hey, stop",
    ]  # fmt: skip


def test_where_nothing_was_read_it_stands_alone() -> None:
    assert with_stop("") == with_stop("hope") == ["freeze", "halt", "stop"]


def test_of_a_long_text_only_the_last_words_are_asked_about() -> None:
    words = [f"w{number}" for number in range(MOST_WORDS + 2)]
    texts = [text.split() for text in with_stop(" ".join(words))]
    assert len(texts) == 3 * MOST_WORDS
    assert all(text[:2] == words[:2] and len(text) == len(words) for text in texts)


@pytest.mark.parametrize(("log_probability", "odds"), [(-3.0, math.exp(-2.0)), (-0.5, 1.0)])
def test_the_likeliest_counts_and_is_at_most_as_likely_as_what_was_read(
    log_probability: float, odds: float
) -> None:
    likely = told({"you should hope": -1.0, "you should halt": log_probability})
    assert stop_odds("you should hope", likely) == pytest.approx(odds)


def test_a_stop_word_that_was_read_needs_no_asking() -> None:
    def never(texts: Sequence[str]) -> list[float]:
        raise AssertionError(texts)

    assert stop_odds("okay, halt", never) == 1.0


def test_it_is_asked_wherever_the_answer_counts() -> None:
    rows = [row for row in STOP_WITNESSES if row.odds]
    assert rows and all(row.surety >= ASKED_FROM for row in rows)
