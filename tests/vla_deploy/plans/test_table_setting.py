"""What is put on a table, of what there is, for one or two people."""

from typing import Any

import pytest

from drivers.clock import NS_PER_S
from vla_deploy.plans.knowledge import world_of
from vla_deploy.plans.table_setting import set_table
from vla_deploy.robots import load_robot
from vla_deploy.world import read_snapshot

CUPS = ("cup_1 coffee_table", "cup_2 coffee_table", "cup_3 side_table")
NARROW, WIDE = (0.07, 0.07, 0.1), (0.3, 0.3, 0.1)


def thing(told: str) -> dict[str, Any]:
    """Return a thing that rests on a place, or in another thing; a second word more makes it wide.

    Its kind is the beginning of its id.
    """
    name, of, *wide = told.split()
    return {
        "id": name,
        "class": name.partition("_")[0],
        "colour": "red",
        "position_m": [2.0, 2.0, 0.5],
        "size_m": WIDE if wide else NARROW,
        "last_seen_ns": 1000 * NS_PER_S,
        "confidence": 0.9,
        "rests": {"relation": "in" if of.startswith("box") else "on", "of": of},
    }


def steps_for(people: str, things: tuple[str, ...]) -> list[Any]:
    """Return what is done for so many people with such things."""
    scene = read_snapshot({"stamp_ns": 1000 * NS_PER_S, "objects": [*map(thing, things)]})
    return set_table("the kitchen table", people, world_of(load_robot("butler"), {}), scene)


def test_a_table_that_is_set_stays_as_it_is() -> None:
    ((skill, _),) = steps_for("two", ("cup_8 kitchen_table", "cup_9 kitchen_table", *CUPS))
    assert skill == "speak"


@pytest.mark.parametrize(
    ("people", "things", "put"),
    [
        ("two", CUPS, "cup_1 cup_2"),
        ("me", CUPS, "cup_1"),
        ("two", (*CUPS[:1], "cup_9 kitchen_table", "bottle_1 side_table"), "cup_1 bottle_1"),
        ("one", ("cup_1 box_1", "bowl_1 side_table wide", "bowl_2 side_table"), "bowl_2"),
        ("us", (), "cup"),
    ],
)
def test_everybody_gets_what_there_is(people: str, things: tuple[str, ...], put: str) -> None:
    steps = steps_for(people, things)
    assert " ".join(given["object"] for _, given in steps) == put
    assert {(skill, given["destination"], given["relation"]) for skill, given in steps} == {
        ("place", "the kitchen table", "on")
    }
