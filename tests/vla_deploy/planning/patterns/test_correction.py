"""What follows a no may change one thing of the plan; where that is not clear, nothing."""

import pytest

from vla_deploy.planning.patterns.follow_up import corrected, correction_in


@pytest.mark.parametrize(
    ("text", "rest"),
    [
        ("no, the blue one", "the blue one"),
        ("No I meant the blue cup.", "the blue cup"),
        ("not that one, the ball", "the ball"),
        ("no wait, the blue one", "the blue one"),
        ("Wait, no, I said the blue one", "the blue one"),
        ("sorry, the blue one", "the blue one"),
        ("I mean the phone", "the phone"),
        ("the blue one I mean", ""),
        ("the other one", "the other one"),
        ("no phone", ""),
        ("no", ""),
        ("the blue one", ""),
        ("nobody is here", ""),
    ],
)
def test_what_follows_a_no_is_found(text, rest):
    assert correction_in(text) == rest


PLACES = {"bedroom": "bedroom", "kitchen": "kitchen", "kitchen table": "kitchen_table"}


@pytest.mark.parametrize(
    ("words", "command"),
    [
        ("the blue one", "put the blue cup in the box"),
        ("blue", "put blue cup in the box"),
        ("the blue cup", "put the blue cup in the box"),
        ("the small box", "put the red cup in the small box"),
        ("the ball", "put the ball in the box"),
        ("the other one", "put the other cup in the box"),
        ("narnia", None),
        ("go home", None),
        ("the bedroom", None),
    ],
)
def test_the_only_thing_that_can_be_meant_is_replaced(words, command):
    told = corrected("put the red cup in the box", f"no, {words}", ["red cup"], PLACES)
    assert told == command


@pytest.mark.parametrize(
    ("command", "text", "about", "told"),
    [
        ("Go to the kitchen!", "no, the bedroom", [], "Go to the bedroom!"),
        ("go to the kitchen table", "no, the bedroom", [], "go to the bedroom"),
        ("put it on the kitchen table", "I mean the bedroom", [], "put it on the bedroom"),
        ("go to the kitchen and to the bedroom", "no, the bedroom", [], None),
        ("Pick up my cup, please", "no, the can", ["cup"], "Pick up the can, please"),
        ("pick up the cup", "no, the green one", ["cup_1"], "pick up the green cup"),
        ("pick up the cup", "the red one", ["cup"], None),
        ("pick it up", "no, the green one", ["cup_1"], None),
        ("pick up the red cup and the green cup", "no, the blue one", ["red cup"], None),
        ("look at the cup and take the ball", "no, the blue one", ["cup", "ball"], None),
    ],
)
def test_what_was_said_takes_the_place_of_one_thing_or_place_or_none(command, text, about, told):
    assert corrected(command, text, about, PLACES) == told
