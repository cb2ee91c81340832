"""Cancel and emergency stop in the middle of the job; the death of control is a cell of `stops`."""

import numpy as np
import pytest

from sim_twin.harness.lockstep_stack import LockstepStack

pytestmark = [pytest.mark.gl, pytest.mark.timeout(120)]

STANDSTILL_RAD_S = 0.02


def joint_speeds(stack: LockstepStack) -> np.ndarray:
    joints = stack.lockstep.truth()["joints"]
    return np.array([abs(joint["velocity"]) for joint in joints.values()])


def drive_until_moving(stack: LockstepStack) -> str:
    command_id = stack.give(text="go to the kitchen")
    assert stack.lockstep.run_until(lambda: wheel_speed(stack) > 5.0, 30.0)
    return command_id


def wheel_speed(stack: LockstepStack) -> float:
    joints = stack.lockstep.truth()["joints"]
    return max(abs(joints[name]["velocity"]) for name in ("left_wheel", "right_wheel"))


def test_stop_cancels_a_drive_and_leaves_the_robot_ready(coarse_stack: LockstepStack) -> None:
    stack = coarse_stack
    command_id = drive_until_moving(stack)
    stack.say("stop")
    assert stack.lockstep.run_until(lambda: wheel_speed(stack) < STANDSTILL_RAD_S, 2.0)
    outcome = stack.outcome(command_id)
    assert outcome is not None
    assert not outcome["success"]
    assert [action["status"] for action in outcome["actions"]] == ["cancelled"]
    assert stack.lockstep.run_until(
        lambda: stack.status()["last_stop"]["state"] == "verified", 0.5
    ), stack.status()["last_stop"]
    assert stack.status()["state"] == "armed"
    assert stack.say("turn left 20 degrees")["success"]


def test_after_an_emergency_stop_commands_are_refused_until_reset_and_arm(
    coarse_stack: LockstepStack,
) -> None:
    stack = coarse_stack
    command_id = drive_until_moving(stack)
    stack.operate("estop")
    assert stack.lockstep.run_until(lambda: joint_speeds(stack).max() < STANDSTILL_RAD_S, 2.0)
    assert stack.lockstep.run_until(lambda: stack.outcome(command_id) is not None, 2.0)
    refusal = stack.say("turn left")
    assert refusal["event"] == "rejected"
    assert "vla-deploy reset" in refusal["reason"]
    assert "vla-deploy arm" in refusal["reason"]
    stack.operate("arm")
    stack.lockstep.run_for(0.5)
    assert stack.status()["estop_latched"]
    stack.operate("reset")
    stack.lockstep.run_for(0.5)
    assert stack.status()["state"] == "disarmed"
    assert "vla-deploy arm" in stack.say("turn left")["reason"]
    stack.arm()
    assert stack.say("turn left 20 degrees")["success"]
