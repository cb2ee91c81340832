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


PICK = {"do": "pick", "what": "red cup"}


@pytest.mark.parametrize(
    ("command", "step", "oddities"),
    [
        ("pick up the red cup", PICK, {"count": 0}),
        ("please pick up the red cup unless the fella objects", PICK,
         {"uncovered": ("unless", "fella", "objects")}),
        ("pick up the wug", {"do": "pick", "what": "wug"}, {"strange": 0}),
        ("zorble up the red cup", PICK, {"strange": 1}),
        ("pick up the red cup", {"do": "pick", "what": "cup"}, {"left_out": 1}),
        ("pick up the red no i mean the blue cup", {"do": "pick", "what": "blue cup"},
         {"count": 0}),
        ("put the red cup in the box",
         {"do": "put", "what": "red box", "where": "box", "how": "in"}, {"jumps": 2}),
        ("move the left arm to the ready pose", {"do": "pose", "name": "ready", "arm": "left"},
         {"uncovered": ()}),
    ],
    ids=["plain", "neither copied nor a filler", "a new word that is copied",
         "a word never shown", "a colour left out", "taken back", "two things as one",
         "what a pose is called by"],
)  # fmt: skip
def test_what_is_odd_is_counted(
    command: str, step: dict[str, str], oddities: dict[str, object]
) -> None:
    found = oddities_of([step], command.split(), KNOWN)
    assert {name: getattr(found, name) for name in oddities} == oddities


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
