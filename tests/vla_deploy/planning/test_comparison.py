"""Two plans move the same where the same things end in the same places, however it is planned."""

from typing import Any

import pytest

from vla_deploy.planning.comparison import move_the_same
from vla_deploy.planning.planner import checked
from vla_deploy.world.thing import Rest

RED = ("pick_up", {"object": "red cup"})
BLUE = ("pick_up", {"object": "blue cup"})
IN_BOX = ("place", {"destination": "box", "relation": "in"})
ON_TABLE = ("place", {"destination": "coffee_table", "relation": "on"})
KITCHEN = ("navigate_to", {"place": "kitchen"})
TO_RED = ("navigate_to", {"object": "red cup"})
FIND_RED = ("find_object", {"object": "red cup"})
FIND_BLUE = ("find_object", {"object": "blue cup"})
SAY = ("speak", {"text": "here you are"})
GIVE = ("hand_over", {})
Steps = tuple[tuple[str, dict[str, Any]], ...]

SAME: tuple[tuple[Steps, Steps], ...] = (
    ((RED,), (("pick_up", {"object": "cup_1"}),)),
    ((RED,), (FIND_RED, TO_RED, RED, SAY)),
    ((RED, IN_BOX), (KITCHEN, RED, ("look_at", {"direction": "left"}), IN_BOX)),
    ((RED, BLUE), (BLUE, RED)),
    ((KITCHEN,), (("navigate_to", {"place": "the kitchen", "yaw_rad": 1.0}), SAY)),
    ((RED, GIVE), (RED, GIVE, ("wait", {"duration_s": 2}))),
    ((SAY,), (("wait", {"duration_s": 5}),)),
    ((("charge", {}),), (("navigate_to", {"place": "charging station"}),)),
)
OTHER: tuple[tuple[Steps, Steps], ...] = (
    ((RED,), (BLUE,)),
    ((RED,), (RED, BLUE)),
    ((RED, IN_BOX), (RED, ON_TABLE)),
    ((RED, IN_BOX), (RED,)),
    ((RED,), (RED, GIVE)),
    ((RED,), (RED, KITCHEN)),
    ((KITCHEN,), (("navigate_to", {"place": "hall"}),)),
    ((KITCHEN,), (SAY,)),
    ((FIND_RED,), (FIND_BLUE,)),
    ((("turn", {"angle_rad": 1.5}),), (("turn", {"angle_rad": -1.5}),)),
    ((("move", {"distance_m": 1.0}),), (("move", {"distance_m": 2.0}),)),
)


@pytest.fixture
def same(ask, propose, scene, thing):
    box = thing("box_1", position_m=(3.0, 1.5, 0.5), size_m=(0.3, 0.3, 0.2))
    cups = tuple(
        thing(one.thing_id, one.colour, rests=Rest("on", "coffee_table")) for one in scene.things
    )
    room = type(scene)(stamp_ns=scene.stamp_ns, things=(*cups, box))
    request = ask("a command", scene=room)

    def same(one: Steps, other: Steps) -> bool:
        plans = (checked(propose(*steps).plan, request) for steps in (one, other))
        return move_the_same(*plans, request)

    return same


@pytest.mark.parametrize(("one", "other"), SAME)
def test_what_leads_up_to_handling_and_what_moves_nothing_is_left_out(same, one, other) -> None:
    assert same(one, other)
    assert same(other, one)


@pytest.mark.parametrize(("one", "other"), OTHER)
def test_other_things_other_places_and_other_ways_are_found(same, one, other) -> None:
    assert not same(one, other)
    assert not same(other, one)
