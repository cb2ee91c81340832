"""Arms without power sink, under a table or beside a cup: the robot gets them out by itself."""

from collections.abc import Callable

import pytest

from sim_twin.harness.lockstep_stack import LockstepStack

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


@pytest.mark.slow
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
    outcome = stack.say("go to the living room")  # which is a metre away
    assert outcome["success"], outcome["error"]
    assert stack.status()["state"] == "armed", "nothing was met on the way out"


TWISTED_OVER_THE_TABLE = {
    "right_shoulder_yaw": -0.38,
    "right_shoulder_pitch": 0.04,
    "right_elbow": 0.93,
    "right_forearm_roll": -2.0,
    "right_wrist_pitch": -1.42,
    "right_wrist_roll": -1.21,
    "right_gripper": 0.045,
    "head_tilt": 0.9,
}


@pytest.mark.timeout(200)
def test_a_hand_that_sank_beside_a_cup_sweeps_nothing_off_the_table(
    make_stack: Callable[[int], LockstepStack],
) -> None:
    stack = make_stack(0)
    engine = stack.lockstep.twin.engine
    engine.pose({**stack.robot.poses["tuck"], **TWISTED_OVER_THE_TABLE})
    engine.place("base", 2.22, 2.06, 0.0, -1.59)
    engine.place("red_cup", 2.10, 1.62, 0.4975, 0.0)
    stack.lockstep.run_for(2.0)
    stack.arm()
    cup = engine.data.body("red_cup")
    before_m = cup.xpos.copy()
    stack.give(text="go to the kitchen")
    stack.lockstep.run_for(6.0)
    assert stack.status()["state"] == "armed"
    assert abs(cup.xpos - before_m).max() < 0.002
