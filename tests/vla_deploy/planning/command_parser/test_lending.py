"""Of several that were named, "the smaller one" is the smaller of their kind, and nothing else."""

import pytest

from vla_deploy.planning.command_parser.lending import kind_lent


@pytest.mark.parametrize(
    ("copied", "means"),
    [
        ("the two bottles the smaller one", "the smaller bottle"),
        ("two bottles smaller one", "the smaller bottle"),
        ("cups on the shelf the red one", "the red cup on the shelf"),
        ("those boxes the one on the left", "the box on the left"),
        ("cups in the kitchen the one in the bedroom", "the cup in the bedroom"),
        ("the three books the middle one", "the middle book"),
        ("books of the middle one", "the middle book"),
    ],
)
def test_the_one_is_of_the_kind_that_was_named(copied: str, means: str) -> None:
    assert kind_lent(copied) == means


@pytest.mark.parametrize(
    "thing",
    [
        "the red cup",
        "the red one",
        "the smaller of the two bottles",
        "two cups",
        "the cup next to the red one",
        "the book and the red one",
        "the bottles the other one",
    ],
)
def test_any_other_thing_is_as_it_is(thing: str) -> None:
    assert kind_lent(thing) == thing
