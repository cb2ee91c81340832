import pytest

from benchmarks.planner_flat import thing_of
from benchmarks.planner_words import Unread, meant

HERE = (2.2, 2.05)
FURNITURE = {"coffee table": "coffee_table"}
THINGS = [
    thing_of(told)
    for told in (
        {"id": "cup_1", "class": "cup", "colour": "red", "on": "coffee_table", "at": [2.2, 1.6]},
        {"id": "cup_2", "class": "cup", "colour": "blue", "on": "kitchen_table", "at": [6.3, 4.3]},
        {
            "id": "ball_1", "class": "ball", "colour": "blue", "on": "coffee_table",
            "at": [2.3, 1.6], "size_m": [0.04, 0.04, 0.04],
        },
        {"id": "ball_2", "class": "ball", "colour": "blue", "in": "box_1", "at": [4.2, 0.46]},
        {"id": "box_1", "class": "box", "colour": "orange", "on": "side_table", "at": [4.2, 0.46]},
    )
]  # fmt: skip


@pytest.mark.parametrize(
    ("text", "names"),
    [
        ("cup_2", ["cup_2"]),
        ("the cup", ["cup_1", "cup_2"]),
        ("mug", ["cup_1", "cup_2"]),
        ("nearest cup", ["cup_1"]),
        ("farthest cup", ["cup_2"]),
        ("small blue ball", ["ball_1"]),
        ("blue ball in the box", ["ball_2"]),
        ("cup on the coffee table", ["cup_1"]),
        ("ball next to the red cup", ["ball_1"]),
        ("blue object", ["ball_1", "ball_2", "cup_2"]),
        ("tall cup", []),
    ],
)
def test_what_an_action_names_is_found(text: str, names: list[str]) -> None:
    assert [one.thing_id for one in meant(text, THINGS, HERE, FURNITURE)] == names


@pytest.mark.parametrize("text", ["", "the", "shiny cup", "cup_1 dance"])
def test_words_that_mean_nothing_are_not_guessed(text: str) -> None:
    with pytest.raises(Unread):
        meant(text, THINGS, HERE, FURNITURE)
