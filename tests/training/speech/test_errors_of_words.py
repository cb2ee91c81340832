import pytest

from training.speech.errors_of_words import count, edits


@pytest.mark.parametrize(
    ("said", "read", "wrong"),
    [
        ("red cup", "red cup", 0),
        ("red cup", "read cup", 1),
        ("the red cup", "red cup", 1),
        ("red cup", "the red cup", 1),
        ("red cup", "", 2),
        ("", "red cup", 2),
    ],
)
def test_words_put_in_left_out_and_exchanged_are_one_error_each(
    said: str, read: str, wrong: int
) -> None:
    assert edits(said.split(), read.split()) == wrong


def test_errors_are_told_by_the_words_said_and_by_whole_texts() -> None:
    told = count([("Go home, please.", "go home please"), ("red cup", "red cap now")])
    assert (told.texts, told.exact, told.words, told.wrong) == (2, 1, 5, 2)
    assert told.error_ratio == pytest.approx(0.4) and told.exact_ratio == 0.5


def test_nothing_said_is_no_error() -> None:
    assert count([]).error_ratio == 0.0
