"""A thing is looked at from two sides of it."""

import math

import pytest

from sim_twin.harness.lockstep_stack import LockstepStack

pytestmark = [pytest.mark.gl, pytest.mark.timeout(240)]

APART_RAD = math.radians(60.0)


def test_it_looks_at_a_thing_from_two_sides_and_tells_what_it_saw(
    coarse_at_table: LockstepStack,
) -> None:
    outcome = coarse_at_table.say("inspect the red cup", 90.0)
    assert outcome["success"], outcome
    data = outcome["actions"][-1]["data"]
    x_m, y_m, _ = coarse_at_table.lockstep.truth()["objects"]["red_cup"]["position_m"]
    first, second = data["sides"]
    bearings = [math.atan2(one["from_y_m"] - y_m, one["from_x_m"] - x_m) for one in (first, second)]
    assert abs(math.remainder(bearings[1] - bearings[0], math.tau)) > APART_RAD
    assert data["apart_rad"] > APART_RAD
    for side in (first, second):
        assert (side["class"], side["colour"]) == ("cup", "red")
        assert math.dist(side["position_m"][:2], (x_m, y_m)) < 0.03
    assert data["position_difference_m"] < 0.03
