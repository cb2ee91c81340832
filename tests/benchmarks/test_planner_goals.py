import math
from dataclasses import replace
from typing import Any

import pytest

from benchmarks.planner_corpus import home, scenes
from benchmarks.planner_goals import GoalUnreadable, parse_goal
from benchmarks.planner_world import FlatWorld


def world(scene: str = "tidy") -> FlatWorld:
    return scenes()[scene].world(home())


def held(flat: FlatWorld, name: str, hand: str) -> FlatWorld:
    flat.things[name] = replace(flat.things[name], held_by=hand, rests=("", ""))
    return flat


def test_a_goal_is_reached_by_any_of_its_ways() -> None:
    goal = parse_goal("held cup_1 left | held cup_1 right; at start")
    assert goal.missed(held(world(), "cup_1", "right"), world()) == ""
    assert goal.missed(world(), world()) == "held cup_1 left"


@pytest.mark.parametrize(
    ("goal", "where", "missed"),
    [
        ("held cup_1; at start", None, ""),
        ("held cup_1; at start", (6.2, 2.2), "held cup_1"),
        ("held cup_1", None, "held cup_1"),
        ("held cup_1 left; at start", None, "held cup_1 left"),
    ],
)
def test_what_is_handed_over_where_it_was_asked_for_is_brought(
    goal: str, where: tuple[float, float] | None, missed: str
) -> None:
    start, end = world(), world()
    xy_m = where or start.pose[:2]
    end.things["cup_1"] = replace(end.things["cup_1"], rests=("with", "speaker"), xy_m=xy_m)
    assert parse_goal(goal).missed(end, start) == missed


def test_what_a_goal_does_not_name_must_stay_where_it_is() -> None:
    end = held(held(world(), "cup_1", "right"), "ball_1", "left")
    assert parse_goal("held cup_1").missed(end, world()) == "ball_1 was not to be touched"


@pytest.mark.parametrize(
    ("goal", "change"),
    [
        ("at kitchen", {"pose": (6.2, 2.2, 0.0)}),
        ("near bottle_1", {"pose": (6.0, 3.8, 0.0)}),
        ("visited kitchen bedroom", {"trail": [(6.2, 2.2, 0.0), (2.6, 4.6, 0.0)]}),
        ("moved 0.5", {"moved_m": 0.5}),
        ("moved -0.6..-0.1", {"moved_m": -0.3}),
        ("turned 90", {"turned_rad": math.pi / 2}),
        ("waited 10", {"waited_s": 10.0}),
        ("head left", {"head": "left"}),
        ("found keys_1", {"found": ["keys_1"]}),
        ("told keys_1", {"said": ["They are on the bedside table."]}),
        ("said dinner is ready", {"said": ["Dinner  is ready!"]}),
        ("gripper both open", {"open_hands": {"left": True, "right": True}}),
        ("pose tuck left", {"arm_pose": {"left": "tuck", "right": ""}}),
    ],
)
def test_each_condition_tells_the_end_from_the_beginning(goal: str, change: dict[str, Any]) -> None:
    end = world()
    for name, value in change.items():
        setattr(end, name, value)
    assert parse_goal(goal).missed(end, world()) == ""
    assert parse_goal(goal).missed(world(), world()) == goal


def test_a_thing_in_a_box_on_furniture_is_down_and_one_on_the_floor_is_only_free() -> None:
    boxed = world("boxed")
    assert parse_goal("down cup_1; free cup_1; in cup_1 box_1").missed(boxed, boxed) == ""
    dropped = world("holding")
    dropped.things["cup_1"] = replace(dropped.things["cup_1"], held_by="", rests=("on", "floor"))
    assert parse_goal("free cup_1").missed(dropped, world("holding")) == ""
    assert parse_goal("down cup_1").missed(dropped, world("holding")) == "down cup_1"


@pytest.mark.parametrize("text", ["", "fly kitchen", "at kitchen;", "at kitchen | "])
def test_a_goal_of_unknown_words_is_refused(text: str) -> None:
    with pytest.raises(GoalUnreadable):
        parse_goal(text)
