import math

import pytest

from vla_deploy.planning.errors import NotUnderstood, UnknownObject, UnknownPlace
from vla_deploy.planning.rules import is_stop, plan_command
from vla_deploy.planning.validator import World, plan_faults

WORLD = World(
    places={
        "kitchen": "kitchen",
        "living room": "living_room",
        "charging station": "charging_station",
        "home": "charging_station",
    },
    poses=frozenset({"tuck"}),
    holding={"left_gripper": None, "right_gripper": None},
)


def steps(text: str, world: World = WORLD) -> list[tuple[str, dict[str, object]]]:
    plan = plan_command(text, world, here=(1.0, 2.0, 0.5))
    assert plan_faults(plan, world) == []
    return [(action.skill, action.parameters) for action in plan.actions]


def test_the_main_command_becomes_find_reach_pick_find_reach_place() -> None:
    assert steps("Pick up the red cup and put it in the box.") == [
        ("find_object", {"object": "red cup"}),
        ("navigate_to", {"object": "red cup"}),
        ("pick_up", {"object": "red cup"}),
        ("find_object", {"object": "box"}),
        ("navigate_to", {"object": "box"}),
        ("place", {"destination": "box", "relation": "in"}),
    ]


@pytest.mark.parametrize(
    "text",
    [
        "put the red cup in the box",
        "please place the red mug into the box",
        "grab the red cup, then drop it in the crate",
        "take the red cup; put it inside the box",
    ],
)
def test_paraphrases_of_put_in_end_in_the_same_plan(text: str) -> None:
    assert steps(text) == steps("pick up the red cup and put it in the box")


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("go to the kitchen", [("navigate_to", {"place": "kitchen"})]),
        ("move forward 1.5 m", [("move", {"distance_m": 1.5})]),
        ("go back half a meter", [("move", {"distance_m": -0.5})]),
        ("turn left", [("turn", {"angle_rad": math.pi / 2})]),
        ("where are the keys?", [("find_object", {"object": "keys"})]),
        ("look left", [("look_at", {"direction": "left"})]),
        ("open your left hand", [("open_gripper", {"arm": "left"})]),
        ("say dinner is ready", [("speak", {"text": "dinner is ready"})]),
        ("wait for 3 seconds", [("wait", {"duration_s": 3.0})]),
    ],
)
def test_a_common_command_has_its_plan(text: str, expected: list[object]) -> None:
    assert steps(text) == expected


def test_bring_me_returns_to_where_the_command_was_given() -> None:
    assert steps("bring me the bottle")[-2:] == [
        ("navigate_to", {"x_m": 1.0, "y_m": 2.0, "yaw_rad": 0.5}),
        ("speak", {"text": "Here is the bottle."}),
    ]


def test_putting_it_away_uses_what_the_hand_already_holds() -> None:
    holding = World(places=WORLD.places, poses=WORLD.poses, holding={"left_gripper": "cup"})
    assert [skill for skill, _ in steps("put it in the box", holding)] == [
        "find_object",
        "navigate_to",
        "place",
    ]


@pytest.mark.parametrize("text", ["Stop!", "please stop", "halt", "freeze", "never mind"])
def test_stop_words_are_recognised(text: str) -> None:
    assert is_stop(text)


def test_a_sentence_that_merely_contains_stop_is_no_stop() -> None:
    assert not is_stop("pick up the bus stop sign")


@pytest.mark.parametrize(
    ("text", "error"),
    [
        ("", NotUnderstood),
        ("sing me a song of the sea", NotUnderstood),
        ("go to the moon", UnknownPlace),
        ("pick up the red cup and dance", NotUnderstood),
        ("put it in the box", UnknownObject),
        ("pick up the red blue cup", UnknownObject),
    ],
)
def test_what_is_not_known_is_refused_with_its_own_error(text: str, error: type[Exception]) -> None:
    with pytest.raises(error):
        plan_command(text, WORLD)
