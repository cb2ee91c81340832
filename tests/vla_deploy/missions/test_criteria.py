"""Criteria in short English are judged against hands, scene and place."""

from dataclasses import replace

import pytest

from vla_deploy.missions.criteria import Facts, judge, read_criterion
from vla_deploy.missions.errors import MissionInvalid

MET, UNKNOWN = "", None


@pytest.mark.parametrize(
    ("text", "known", "verdict"),
    [
        ("holding the red cup", {"left": "cup"}, MET),
        ("holding_cup", {"left": "cup"}, MET),
        ("holding the red cup", {}, "the hands hold nothing"),
        ("the cup is held", {"left": "cup"}, MET),
        ("the hands are empty", {}, MET),
        ("gripper empty", {"left": "cup"}, "a hand holds cup_1"),
        ("at_kitchen_location", {}, MET),
        ("the robot is in the kitchen", {"place": "bedroom"}, "m from the kitchen"),
        ("the red cup is in the box", {"cup": ("in", "box_1")}, MET),
        ("the red cup is in the box", {"cup": ("on", "coffee_table")}, "the red cup is on"),
        ("red cup on the coffee table", {"cup": ("on", "coffee_table")}, MET),
        ("the keys are in the box", {}, UNKNOWN),
        ("nothing on the coffee table", {"cup": ("on", "coffee_table")}, "still there: cup_1"),
        ("no ball on the coffee table", {"cup": ("on", "coffee_table")}, MET),
        ("the coffee table is clear", {}, MET),
    ],
)
def test_a_criterion_is_met_or_why_it_is_not(facts, text, known, verdict) -> None:
    found = judge(text, facts(**known))
    assert (found == verdict) if not verdict else (found and verdict in found)


@pytest.mark.parametrize(
    "text", ["the hands are empty", "the red cup is in the box", "nothing on the coffee table",
             "at the kitchen"],
)  # fmt: skip
def test_what_nobody_knows_is_neither_met_nor_unmet(world, text) -> None:
    nothing = Facts(world=replace(world, holding={}))
    assert judge(text, nothing) is UNKNOWN


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("the moon is in the box", "moon"),
        ("holding the sun", "the sun"),
        ("everybody is happy", "cannot be checked; write for example"),
        ("nothing on the moon", "the moon"),
        ("at the moon", "the moon"),
    ],
)
def test_a_criterion_that_cannot_be_checked_is_refused_by_name(world, text, why) -> None:
    with pytest.raises(MissionInvalid, match=why):
        read_criterion(text, world)
