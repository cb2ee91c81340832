"""A finger that comes down on a cup feels it: the hand rises, looks again, and takes it."""

import numpy as np
import pytest

from sim_twin.stack import LockstepStack

pytestmark = pytest.mark.gl

HAND, CUP = "left_grip", "red_cup"
NUDGE_M = 0.014
ABOVE_M = (0.08, 0.14)
STILL_M = 0.0005


def _way_to_the_cup_m(stack: LockstepStack) -> np.ndarray:
    data = stack.lockstep.twin.engine.data
    return np.array(data.body(CUP).xpos - data.site(HAND).xpos)


def _is_about_to_come_down(stack: LockstepStack) -> bool:
    """Tell whether the hand stands still above the cup."""
    before_m = _way_to_the_cup_m(stack)
    stack.lockstep.run_for(0.02)
    way_m = _way_to_the_cup_m(stack)
    is_above = float(np.hypot(*way_m[:2])) < 0.02 and ABOVE_M[0] < -way_m[2] < ABOVE_M[1]
    return is_above and float(np.abs(way_m - before_m).max()) < STILL_M


def _nudge(stack: LockstepStack) -> None:
    """Move the cup along the line on which the fingers close, so that one comes down on its rim."""
    engine = stack.lockstep.twin.engine
    x_m, y_m, z_m = engine.data.body(CUP).xpos
    across = engine.data.site(HAND).xmat.reshape(3, 3)[:, 1]
    engine.place(CUP, x_m + NUDGE_M * across[0], y_m + NUDGE_M * across[1], z_m, 0.0)


@pytest.mark.timeout(240)
def test_a_cup_that_is_nudged_under_the_hand_is_taken_all_the_same(stack: LockstepStack) -> None:
    command = stack.give(text="pick up the red cup")
    assert stack.lockstep.run_until(lambda: _is_about_to_come_down(stack), 60.0)
    _nudge(stack)
    assert stack.lockstep.run_until(lambda: -_way_to_the_cup_m(stack)[2] > ABOVE_M[1], 30.0), (
        "the hand rises again"
    )
    assert stack.status()["state"] == "armed"
    assert stack.lockstep.run_until(lambda: stack.outcome(command) is not None, 60.0)
    outcome = stack.outcome(command)
    assert outcome is not None
    assert outcome["success"], outcome["error"]
    assert CUP in stack.lockstep.truth()["held"]
