"""The judge must be stricter than the robot: each plan here fails, or ends where it should."""

from typing import Any

import pytest

from benchmarks.planner_corpus import home, scenes
from benchmarks.planner_effects import perform
from benchmarks.planner_world import ActionFails, FlatWorld

Step = tuple[str, dict[str, Any]]


def world(scene: str = "tidy") -> FlatWorld:
    return scenes()[scene].world(home())


def actions(*steps: Step) -> list[dict[str, Any]]:
    return [
        {"id": f"a{number}", "skill": skill, "parameters": parameters}
        for number, (skill, parameters) in enumerate(steps)
    ]


GO_TO_CUP = ("navigate_to", {"object": "red cup"})
TAKE_CUP = ("pick_up", {"object": "red cup"})
GO_TO_BOX = ("navigate_to", {"object": "box"})
INTO_BOX = ("place", {"destination": "box", "relation": "in"})


def test_a_thing_that_is_taken_along_ends_in_the_box() -> None:
    flat = world()
    perform(flat, actions(GO_TO_CUP, TAKE_CUP, GO_TO_BOX, INTO_BOX))
    assert flat.things["cup_1"].rests == ("in", "box_1")
    assert flat.furniture_of(flat.things["cup_1"]) == "side_table"


@pytest.mark.parametrize(
    ("scene", "steps", "why"),
    [
        ("tidy", [TAKE_CUP], "m away"),
        ("unseen", [GO_TO_CUP], "is known"),
        ("tidy", [GO_TO_CUP, TAKE_CUP, INTO_BOX], "m away"),
        ("tidy", [GO_TO_BOX, INTO_BOX], "no such hand holds"),
        ("tidy", [GO_TO_BOX, ("pick_up", {"object": "box"})], "no hand takes"),
        ("both_hands", [GO_TO_CUP, TAKE_CUP], "no such hand is free"),
        ("tidy", [GO_TO_CUP, TAKE_CUP,
                  ("place", {"destination": "red cup", "relation": "in"})], "nothing can be put"),
        ("holding", [("place", {"destination": "kitchen table", "relation": "on"})], "reach"),
        ("tidy", [("navigate_to", {"x_m": 3.9, "y_m": 5.5})], "no floor"),
        ("tidy", [("move", {"distance_m": -2.0})], "no floor"),
        ("tidy", [("move_arm", {"pose": "salute"})], "no such pose"),
        ("tidy", [("fly", {})], "fly"),
        ("sorting", [("navigate_to", {"place": "bedside table"}),
                     ("pick_up", {"object": "book"})], "something rests on it"),
    ],
)  # fmt: skip
def test_what_the_robot_cannot_do_fails_with_its_reason(
    scene: str, steps: list[Step], why: str
) -> None:
    with pytest.raises(ActionFails, match=why):
        perform(world(scene), actions(*steps))


def test_a_thing_that_was_not_seen_is_found_first() -> None:
    flat = world("unseen")
    perform(flat, actions(("find_object", {"object": "keys"}), ("pick_up", {"object": "keys"})))
    assert flat.things["keys_1"].held_by == "left"
    assert flat.found == ["keys_1"]


def test_an_open_hand_drops_what_it_held() -> None:
    flat = world("holding")
    perform(flat, actions(("open_gripper", {"arm": "right"})))
    assert flat.things["cup_1"].rests == ("on", "floor")


def test_what_is_handed_over_is_with_who_takes_it() -> None:
    flat = world("holding")
    perform(flat, actions(("hand_over", {})))
    assert flat.things["cup_1"].rests == ("with", "speaker")
    with pytest.raises(ActionFails, match="0 hands hold"):
        perform(flat, actions(("hand_over", {})))


def test_actions_wait_for_those_that_they_depend_on() -> None:
    steps = actions(TAKE_CUP, GO_TO_CUP)
    steps[0]["depends_on"] = ["a1"]
    flat = world()
    perform(flat, steps)
    assert flat.things["cup_1"].held_by
    steps[1]["depends_on"] = ["a0"]
    with pytest.raises(ActionFails, match="waits for what never comes"):
        perform(world(), steps)


def test_an_expression_that_fits_several_things_is_kept_open() -> None:
    flat = world("cups")
    perform(flat, actions(("look_at", {"object": "cup"})))
    assert set(flat.open_choices["cup"]) == {"cup_1", "cup_2", "cup_3"}
