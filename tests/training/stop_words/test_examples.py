"""What the ear learns as other talk is whole sentences in which nobody says a stop word."""

from pathlib import Path

import numpy as np
import pytest

from training.stop_words.examples import Examples

_LINES = (
    '  1 This software and database is "quoted in its licence"',
    '00000001 29 v 01 sigh 0 001 | breathe deeply; "She sighed sadly"; "the trees sighed in May"',
    '00000002 29 v 01 stop 0 001 | come to a halt; "the car came to a halt"; "he stopped to talk"',
    '00000003 29 v 01 cost 0 001 | be priced at; "It cost $ 30 in 1990"; "too dear"',
)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    for part in ("adj", "adv", "noun", "verb"):
        (tmp_path / f"data.{part}").write_text("\n".join(_LINES), encoding="utf-8")
    return tmp_path


def test_sentences_are_read_without_the_licence_numbers_and_stop_words(folder: Path) -> None:
    examples = Examples(folder)
    assert examples.others == ["She sighed sadly"]
    assert examples.alike == ["he stopped to talk", "the trees sighed in May"]


def test_what_sounds_like_a_stop_word_comes_as_often_as_all_else(folder: Path) -> None:
    examples, random = Examples(folder), np.random.default_rng(0)
    draws = [examples.draw(random) for _ in range(400)]
    drawn = [one.text for one in draws]
    assert all(one.is_ordinary == (one.text in examples.others) for one in draws)
    assert 150 < drawn.count("She sighed sadly") < 250
    assert set(drawn) == {*examples.alike, *examples.others}


def test_without_wordnet_it_says_how_to_get_it(tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError, match="wordnet-base"):
        Examples(tmp_path / "none")
