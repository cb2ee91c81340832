"""A hand that comes down on something feels it: it rises, looks again, and tries anew."""

import numpy as np
import pytest

from sim_twin.harness.lockstep_stack import LockstepStack

pytestmark = pytest.mark.gl

HAND, CUP, BOX = "left_grip", "red_cup", "box"
NUDGE_M = 0.014
# The box's wall comes under the cup.
BOX_NUDGE_M = 0.10
ABOVE_M = (0.08, 0.14)
STILL_M = 0.0005


def _way_m(stack: LockstepStack, body: str) -> np.ndarray:
    data = stack.lockstep.twin.engine.data
    return np.array(data.body(body).xpos - data.site(HAND).xpos)


def _is_about_to_come_down(
    stack: LockstepStack, body: str, above_m: tuple[float, float], beside_m: float
) -> bool:
    """Return whether the hand stands still above a thing."""
    before_m = _way_m(stack, body)
    stack.lockstep.run_for(0.02)
    way_m = _way_m(stack, body)
    is_above = float(np.hypot(*way_m[:2])) < beside_m and above_m[0] < -way_m[2] < above_m[1]
    return is_above and float(np.abs(way_m - before_m).max()) < STILL_M


def _nudge(stack: LockstepStack) -> None:
    """Move the cup along the line on which the fingers close, so that one comes down on its rim."""
    engine = stack.lockstep.twin.engine
    x_m, y_m, z_m = engine.data.body(CUP).xpos
    across = engine.data.site(HAND).xmat.reshape(3, 3)[:, 1]
    engine.place(CUP, x_m + NUDGE_M * across[0], y_m + NUDGE_M * across[1], z_m, 0.0)


@pytest.mark.slow
@pytest.mark.timeout(240)
def test_a_cup_that_is_nudged_under_the_hand_is_taken_all_the_same(stack: LockstepStack) -> None:
    command = stack.give(text="pick up the red cup")
    assert stack.lockstep.run_until(lambda: _is_about_to_come_down(stack, CUP, ABOVE_M, 0.02), 60.0)
    _nudge(stack)
    assert stack.lockstep.run_until(lambda: -_way_m(stack, CUP)[2] > ABOVE_M[1], 30.0), (
        "the hand rises again"
    )
    assert stack.status()["state"] == "armed"
    outcome = stack.end_of(command, 60.0)
    assert outcome["success"], outcome["error"]
    assert CUP in stack.lockstep.truth()["held"]


@pytest.mark.slow
@pytest.mark.timeout(300)
def test_a_cup_that_comes_down_on_the_rim_of_a_box_is_raised_and_put_into_it(
    coarse_at_table: LockstepStack,
) -> None:
    stack = coarse_at_table
    engine = stack.lockstep.twin.engine
    command = stack.give(text="pick up the red cup and put it in the box")
    above = (0.15, 0.30)
    assert stack.lockstep.run_until(lambda: _is_about_to_come_down(stack, BOX, above, 0.03), 120.0)
    x_m, y_m, z_m = engine.data.body(BOX).xpos
    engine.place(BOX, x_m - BOX_NUDGE_M, y_m, z_m, 0.0)
    outcome = stack.end_of(command, 120.0)
    assert outcome["success"], outcome["error"]
    tries = [str(one.get("error")) for one in stack.events if one["event"] == "action"]
    assert any("has met something" in error for error in tries), tries
    assert stack.status()["state"] == "armed"
    assert stack.lockstep.inside(CUP, BOX)["inside"]
