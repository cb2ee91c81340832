"""What is odd about an answer lowers how sure it is, whatever the model thinks of it."""

import pytest

from vla_deploy.inference.manifest import Certainty
from vla_deploy.planning.command_parser.certainty import (
    Oddities,
    confidence_of,
    features_of,
    oddities_of,
)
from vla_deploy.planning.command_parser.wording import find_span

KNOWN = frozenset(
    [
        "pick",
        "up",
        "the",
        "put",
        "it",
        "in",
        "box",
        "on",
        "go",
        "to",
        "and",
        "red",
        "cup",
        "no",
        "i",
        "mean",
        "blue",
    ]
)
WEIGHTS = Certainty(
    bias=4.0, least=1.0, mean=2.0, strange=-2.0, read_back_below=0.85, decline_below=0.3
)


def odd(command: str, *steps: dict[str, str]) -> Oddities:
    return oddities_of(steps, command.split(), KNOWN)


def test_a_plain_answer_has_nothing_odd() -> None:
    assert odd("pick up the red cup", {"do": "pick", "what": "red cup"}).count == 0


def test_each_word_that_is_neither_copied_nor_a_filler_is_told() -> None:
    found = odd("please pick up the cup unless the fella objects", {"do": "pick", "what": "cup"})
    assert found.uncovered == ("unless", "fella", "objects")


def test_a_word_never_shown_is_odd_unless_it_is_copied() -> None:
    assert odd("pick up the wug", {"do": "pick", "what": "wug"}).strange == 0
    assert odd("zorble up the red cup", {"do": "pick", "what": "red cup"}).strange == 1


def test_a_colour_or_kind_that_is_left_out_is_odd() -> None:
    assert odd("pick up the red cup", {"do": "pick", "what": "cup"}).left_out == 1


def test_what_was_taken_back_may_be_left_out() -> None:
    taken_back = odd("pick up the red no i mean the blue cup", {"do": "pick", "what": "blue cup"})
    assert taken_back.count == 0


def test_words_of_two_things_copied_as_one_are_odd() -> None:
    command = "put the red cup in the box"
    assert odd(command, {"do": "put", "what": "red box", "where": "box", "how": "in"}).jumps > 0


def test_a_span_keeps_the_articles_that_were_said() -> None:
    command = ["grab", "the", "cup", "on", "the", "left", "of", "a", "book", "now"]
    span = find_span(["cup", "on", "left", "of", "book"], command)
    assert span is not None
    assert " ".join(span.spoken) == "the cup on the left of a book"
    assert span.jumps == 0


def test_words_that_nobody_said_have_no_span() -> None:
    assert find_span(["green"], ["red", "cup"]) is None


@pytest.mark.parametrize(("count", "least"), [(0, -0.01), (0, -3.0), (2, -0.01)])
def test_doubt_and_oddities_lower_the_confidence(count: int, least: float) -> None:
    best = confidence_of(features_of([0.0], Oddities()), WEIGHTS)
    told = confidence_of(features_of([least, 0.0], Oddities(strange=count)), WEIGHTS)
    assert 0.0 < told < best
