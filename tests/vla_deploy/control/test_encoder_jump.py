"""An encoder that jumps stops the robot, and no servo runs after what it says."""

from typing import Any
from typing import Any as Rig  # the class in conftest.py, which no test can import

import pytest

JUMP_RAD = 1.0
# What the servo itself does before control's next tick, and what its ramp takes to end.
KICK_RAD = 0.03


def true_elbow(rig: Rig) -> float:
    return float(rig.lockstep.truth()["joints"]["left_elbow"]["position"])


def jump(rig: Rig) -> Any:
    """Let the encoder jump; clearing what comes back lets it jump back."""
    return rig.lockstep.faults.inject("servo", "left_elbow", "wrong", offset_rad=JUMP_RAD)


def test_the_arm_stays_where_it_is_when_its_encoder_jumps_and_when_it_jumps_back(
    armed: Rig,
) -> None:
    armed.go(1, left_elbow=1.2)
    armed.run(2.5)
    before = true_elbow(armed)
    fault = jump(armed)
    armed.run(1.0)
    assert (armed.state, armed.status["cause"]) == ("stopped", "encoder_jump")
    assert armed.status["subject"] == "left_elbow"
    assert armed.joint("left_elbow", "setpoint") == pytest.approx(before + JUMP_RAD, abs=0.1)
    assert true_elbow(armed) == pytest.approx(before, abs=KICK_RAD)
    armed.ask("reset", "arm")
    assert armed.state == "armed", armed.status["detail"]
    fault.clear()
    armed.run(1.0)
    assert (armed.state, armed.status["cause"]) == ("stopped", "encoder_jump")
    assert true_elbow(armed) == pytest.approx(before, abs=2 * KICK_RAD)


def test_a_motion_under_way_ends_and_the_other_joints_ramp_to_rest(armed: Rig) -> None:
    armed.go(1, left_elbow=1.6, head_pan=1.2)
    armed.run(0.5)
    before = true_elbow(armed)
    jump(armed)
    armed.run(1.0)
    (result,) = armed.results()
    assert result["status"] == "stopped"
    assert "encoder_jump (left_elbow)" in result["reason"]
    assert true_elbow(armed) == pytest.approx(before, abs=0.15)
    assert 0.0 < armed.joint("head_pan") < 1.2
    assert armed.true_speeds().max() < 0.01


def test_the_fastest_own_motion_is_no_jump(armed: Rig) -> None:
    armed.go(1, left_wrist_roll=3.0, right_wrist_roll=-3.0, left_gripper=0.044, head_pan=1.5)
    armed.run(2.5)
    assert armed.state == "armed", armed.status["detail"]
