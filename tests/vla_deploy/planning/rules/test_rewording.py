"""Roundabout commands become plain ones, and words that belong together stay so."""

import pytest

from vla_deploy.planning.rules.rewording import reworded


@pytest.mark.parametrize(
    ("said", "plain"),
    [
        ("gimme the cup", "give me the cup"),
        ("that can go in the box", "that should go in the box"),
        ("off to the kitchen with you", "go to the kitchen"),
        ("make sure that the red can ends up in the box", "put the red can in the box"),
        ("three books there, i want you holding the middle one", "hold the middle book"),
        ("red can goes in the box", "the red can goes in the box"),
        ("put down what's in the left one", "put down what's in your left hand"),
        (
            "phone down on this table, can over to the desk",
            "put the phone down on this table, put the can over to the desk",
        ),
        ("fetch me the cup here into the kitchen", "fetch me the cup"),
        ("fire them keys in the box", "put those keys in the box"),
    ],
)
def test_a_roundabout_command_is_put_plainly(said: str, plain: str) -> None:
    assert reworded(said) == plain


@pytest.mark.parametrize(
    "said",
    [
        "bring me keys",
        "put the cup next to the book",
        "take the cup and keep the can",
        "drive into the cat's basket",
    ],
)
def test_a_plain_command_stays_as_it_is(said: str) -> None:
    assert reworded(said) == said
