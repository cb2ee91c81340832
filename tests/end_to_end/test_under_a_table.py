"""Arms without power sink; where they came to lie under a table, the robot gets out by itself."""

from collections.abc import Callable

import pytest

from sim_twin.stack import LockstepStack

pytestmark = pytest.mark.gl

BEFORE_THE_COFFEE_TABLE = (2.29, 2.0, 0.0, -2.38)
SUNK = {
    "left_shoulder_yaw": -0.11,
    "left_shoulder_pitch": -0.03,
    "left_elbow": 0.8,
    "left_wrist_pitch": -2.52,
    "left_wrist_roll": 1.45,
    "right_shoulder_yaw": 0.22,
    "right_shoulder_pitch": -0.13,
    "right_elbow": 1.19,
    "right_wrist_pitch": -2.56,
    "right_wrist_roll": -1.61,
    "head_pan": 0.28,
    "head_tilt": 0.86,
}


@pytest.mark.timeout(200)
def test_arms_that_lie_under_a_table_are_drawn_out_before_they_rise(
    make_stack: Callable[[int], LockstepStack],
) -> None:
    stack = make_stack(0)
    engine = stack.lockstep.twin.engine
    engine.pose(SUNK)
    engine.place("base", *BEFORE_THE_COFFEE_TABLE)
    stack.lockstep.run_for(2.0)
    stack.arm()
    outcome = stack.say("go to the kitchen")
    assert outcome["success"], outcome["error"]
    assert stack.status()["state"] == "armed", "nothing was met on the way out"
