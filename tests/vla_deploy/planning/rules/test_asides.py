"""What a sentence says aside, put where it belongs, and what is left as it was said."""

from collections.abc import Callable
from typing import TYPE_CHECKING

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from vla_deploy.planning.errors import NotThere, NotUnderstood, PlanningError, UnknownObject
from vla_deploy.planning.rules.asides import straightened

if TYPE_CHECKING:
    from conftest import Flat

BOX = "place box in"
TWO_OF_THEM = "pick_up red cup left; pick_up ball right"

STRAIGHTENED = {
    "the orange box, lay the book in it": "lay the book in the orange box",
    "the bedroom, drive there please": "drive to the bedroom please",
    "grab the second cup, counting from the right": "grab the second from the right cup",
    "starting from the left, find the first book": "find the first from the left book",
    "lift a cup, not the blue one": "lift a cup but not the blue one",
    "lift the cup, not the blue one, the other one": "lift the cup but not the blue one",
    "lift the cup, not the blue one, the red one": "lift the cup, i mean the red one",
    "fetch the thing on the table, the book": "fetch the book on the table",
    "grab the round object, the ball, and go home": "grab the round ball, and go home",
    "hold the cup, the red one": "hold the red cup",
    "that ball on the coffee table there, get it": "get that ball that is on the coffee table",
    "the cups, lay them all in the box": "lay the cups in the box",
    "lift it up, the red cup": "lift the red cup up",
}
AS_SAID = (
    "take the red cup, the ball",
    "take the cup, the blue one, the ball",
    "the orange box, take the ball and put it in there",
    "put the cup in the box, not the red one",
    "the ball, the book",
    "find the cup and put it in the box, the book",
    "say the words, it is late",
    "lift the thing on the table, also the ball",
)


@pytest.mark.parametrize(("said", "straight"), list(STRAIGHTENED.items()))
def test_an_aside_is_put_where_it_belongs(flat: "Flat", said: str, straight: str) -> None:
    assert straightened(said, flat.request(said)) == straight


@pytest.mark.parametrize("said", AS_SAID)
def test_what_is_no_aside_stays_as_it_was_said(flat: "Flat", said: str) -> None:
    assert straightened(said, flat.request(said)) == said


@pytest.mark.parametrize(
    ("said", "done"),
    [
        ("the orange box, lay the purple book in it", "place orange box in"),
        ("the red cup and the ball, take them", TWO_OF_THEM),
        ("could you lift the first cup, counted from the left?", "pick_up cup_2"),
        ("take a cup, but not the red one", "pick_up cup_2"),
        ("put the coffee table's green ball in the box", BOX),
        ("put all cups but the blue one on the side table", "place side_table on"),
        ("find the thing with the purple cover, the book", "find_object purple book"),
        ("take the red cup that is on the coffee table", "pick_up cup_1"),
        ("take the cup furthest to the left", "pick_up cup_2"),
        ("lay the ball on the left in the box", BOX),
        ("go near the cup farthest from the ball", "navigate_to cup_2"),
    ],
)
def test_a_described_thing_is_acted_on(does: Callable[..., str], said: str, done: str) -> None:
    assert does(said) == done


def test_what_is_brought_goes_by_its_name_only(does: Callable[..., str]) -> None:
    assert does("bring me the cup that isn't red").endswith("speak Here you are.")
    assert does("bring me the second cup from the left").endswith(
        "speak Here is the second cup from left."
    )


@pytest.mark.parametrize(
    ("said", "error"),
    [
        ("the third cup from the left, lift it", NotThere),
        ("take the ball that isn't green", NotThere),
        ("the red cup, don't touch it", NotUnderstood),
        ("lift the ball, not the elephant", NotUnderstood),
        ("lay the red cup on the left", UnknownObject),
        ("lift the second one", UnknownObject),
    ],
)
def test_what_is_not_there_or_not_wanted_is_not_done(
    does: Callable[..., str], said: str, error: type[PlanningError]
) -> None:
    with pytest.raises(error):
        does(said)


VOCABULARY = (
    "the the the a red blue cup cups ball box one ones thing it them there second first last from "
    "left right of two not but isn't that other than nearest to farthest any all except counting "
    "take put in on table table's bring find bigger round drink , , , - . : please \\1 \\cup"
)
SENTENCES = st.lists(st.sampled_from(VOCABULARY.split()), max_size=16).map(" ".join)


@settings(max_examples=200, deadline=None)
@given(SENTENCES)
def test_any_description_is_refused_by_name_or_makes_a_valid_plan(flat: "Flat", text: str) -> None:
    flat.refuses_or_plans(text)
