"""A hand takes a cup from the side, also after one from above did not hold, and carries it on."""

import math
from typing import Any

import pytest

from sim_twin.campaigns.missions import OFFER
from sim_twin.harness.lockstep_stack import LockstepStack

pytestmark = pytest.mark.gl

CUP, BOX, HAND = "red_cup", "box", "left_grip"
AWAY_M = 0.09
LOW_M = 0.06


def _take(stack: LockstepStack, **how: Any) -> dict[str, Any]:
    action = {"skill": "pick_up", "parameters": {"object": "red cup", **how}}
    return stack.end_of(stack.give(plan={"goal": "take", "actions": [action]}), 120.0)


def _lean_rad(stack: LockstepStack) -> float:
    _, x, y, _ = stack.lockstep.truth()["objects"][CUP]["quaternion_wxyz"]
    return math.acos(1.0 - 2.0 * (x * x + y * y))


@pytest.mark.slow
@pytest.mark.timeout(240)
def test_a_cup_taken_from_the_side_is_carried_upright_and_goes_into_the_box(
    coarse_at_table: LockstepStack,
) -> None:
    stack = coarse_at_table
    taken = _take(stack, grasp="side", careful=True)
    assert taken["success"], taken["error"]
    assert "from the side" in taken["actions"][-1]["note"]
    assert CUP in stack.lockstep.truth()["held"]
    assert _lean_rad(stack) < 0.15
    put = stack.say("put it in the box")
    assert put["success"], put["error"]
    assert stack.lockstep.inside(CUP, BOX)["inside"]


@pytest.mark.slow
@pytest.mark.timeout(240)
def test_a_cup_taken_from_the_side_is_handed_over(coarse_at_table: LockstepStack) -> None:
    stack = coarse_at_table
    assert _take(stack, grasp="side")["success"]
    command = stack.give(text="hand it over")

    def is_offered() -> bool:
        return stack.outcome(command) is None and stack.has_said(OFFER)

    assert stack.lockstep.run_until(is_offered, 30.0)
    stack.lockstep.twin.person.take(CUP)
    assert stack.end_of(command, 120.0)["success"]
    assert stack.lockstep.twin.person.taken == (CUP,)


@pytest.mark.slow
@pytest.mark.timeout(240)
def test_what_a_hand_from_above_did_not_hold_is_taken_from_the_side(
    coarse_at_table: LockstepStack,
) -> None:
    stack = coarse_at_table
    engine = stack.lockstep.twin.engine

    def is_around_it() -> bool:
        way_m = engine.data.site(HAND).xpos - engine.data.body(CUP).xpos
        return math.hypot(way_m[0], way_m[1]) < 0.03 and way_m[2] < LOW_M

    action = {"skill": "pick_up", "parameters": {"object": "red cup"}}
    command = stack.give(plan={"goal": "take", "actions": [action]})
    assert stack.lockstep.run_until(is_around_it, 60.0)
    x_m, y_m, z_m = engine.data.body(CUP).xpos
    engine.place(CUP, x_m - AWAY_M, y_m, z_m, 0.0)
    outcome = stack.end_of(command, 120.0)
    assert outcome["success"], outcome["error"]
    assert "from the side" in outcome["actions"][-1]["note"]
    assert outcome["actions"][-1]["retries"] == 0
    assert CUP in stack.lockstep.truth()["held"]
