"""Roundabout commands become plain ones, and words that belong together stay so."""

import pytest

from vla_deploy.planning.rules.rewording import reworded


@pytest.mark.parametrize(
    ("said", "plain"),
    [
        ("gimme the cup", "give me the cup"),
        ("where on earth are my keys", "where are my keys"),
        ("bring us me keys", "bring us my keys"),
        ("that can go in the box", "that should go in the box"),
        ("pick up his phone", "pick up the phone"),
        ("off to the kitchen with you", "go to the kitchen"),
        ("use your left hand and take the book", "take the book with your left hand"),
        ("make sure that the red can ends up in the box", "put the red can in the box"),
        ("pick out the middle one of the three books", "pick out the middle book"),
        ("of the two cups there, take the red one", "take the red cup"),
        ("three books there, i want you holding the middle one", "hold the middle book"),
        ("not the red cup, the blue one", "the blue cup"),
        ("not the green one, the little bottle", "the little bottle"),
        ("take the cup off the table", "take the cup from the table"),
        ("red can goes in the box", "the red can goes in the box"),
        ("you're needed at the entrance", "go to the entrance"),
        ("turn about ninety degrees", "turn ninety degrees"),
        ("put down what's in the left one", "put down what's in your left hand"),
        ("the phone you can give to me, the can you keep", "give me the phone, keep the can"),
        ("with the other one please do the same", "do the same with the other one"),
        ("i'd like the red one there as well", "put the red one there as well"),
        (
            "phone down on this table, can over to the desk",
            "put the phone down on this table, put the can over to the desk",
        ),
        (
            "clear away the outermost book on the left, it comes on the desk",
            "put the leftmost book on the desk",
        ),
        ("i've got a grip of the cup, you can let it go", "let go of the cup"),
        ("fetch me the cup here into the kitchen", "fetch me the cup"),
        ("keep the can in the box", "put the can in the box"),
        ("drive up to wherever the can is", "drive up to the can"),
        ("put it on the table where the red can is", "put it next to the red can"),
        ("fire them keys in the box", "put those keys in the box"),
    ],
)
def test_a_roundabout_command_is_put_plainly(said: str, plain: str) -> None:
    assert reworded(said) == plain


@pytest.mark.parametrize(
    "said",
    [
        "bring me keys",
        "pick up that can",
        "bring her the cup",
        "turn around",
        "say that can is red",
        "put the cup next to the book",
        "take the ball to the kitchen",
        "ball in the box",
        "take the cup and keep the can",
        "keep the cup in your left hand",
        "keep the can in the box until i come",
        "drive into the cat's basket",
    ],
)
def test_a_plain_command_stays_as_it_is(said: str) -> None:
    assert reworded(said) == said
