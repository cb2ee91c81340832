import re
from pathlib import Path

import numpy as np

from training.speech.clips.planner_commands import draw_planner_command
from training.speech.clips.sentences import (
    MOST_WORDS,
    draw_sentence,
    fill,
    held_out,
    normal,
    read_tables,
    tables,
)


def test_drawn_sentences_are_seeded_plain_and_never_those_for_judging() -> None:
    first, again = (
        [draw_sentence(random) for _ in range(300)]
        for random in (np.random.default_rng(5), np.random.default_rng(5))
    )
    assert first == again
    assert all(re.fullmatch(r"[a-z' ]+", text) for text in first)
    assert not held_out() & set(first)


def test_every_kind_that_a_pattern_names_is_there() -> None:
    named = {kind for entries in tables().values() for e in entries for kind in _named(e)}
    assert named and named <= set(tables())


def _named(entry: str) -> list[str]:
    return re.findall(r"<(\w+)>", entry)


def test_choices_and_kinds_are_filled_until_only_words_are_left() -> None:
    text = fill("(go|drive) to <where>( now|)", np.random.default_rng(0))
    assert text.split()[0] in ("go", "drive") and not re.search(r"[<>()|]", text)


def test_a_file_of_patterns_keeps_commas_and_one_of_words_is_split_at_them(tmp_path: Path) -> None:
    for name in ("words.txt", "sentences.txt"):
        (tmp_path / name).write_text("# why\n[kind]\none, two\n")
    assert read_tables(tmp_path / "words.txt") == {"kind": ["one", "two"]}
    assert read_tables(tmp_path / "sentences.txt") == {"kind": ["one, two"]}


def test_texts_are_compared_without_case_and_punctuation() -> None:
    assert normal("Don't  stop, Robot!") == "don't stop robot"


def test_commands_of_the_command_parser_are_among_them_as_words_alone() -> None:
    random = np.random.default_rng(6)
    drawn = [draw_planner_command(random) for _ in range(300)]
    assert all(re.fullmatch(r"[a-z']+( [a-z']+)*", text) for text in drawn)
    words = {word for text in drawn for word in text.split()}
    assert "meters" in words and not words & {"metres", "cm", "gray"}


def test_no_sentence_is_longer_than_the_longest_that_is_learnt() -> None:
    random = np.random.default_rng(7)
    lengths = [len(draw_sentence(random).split()) for _ in range(500)]
    assert 16 < max(lengths) <= MOST_WORDS
