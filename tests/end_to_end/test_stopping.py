"""Cancel, emergency stop and the death of control, in the middle of the job."""

import numpy as np
import pytest

from platforms import load_profile
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


def reach_until_moving(stack: LockstepStack) -> str:
    """Start moving both arms to their tucked pose and return in the middle of it."""
    command_id = stack.give(plan={"goal": "tuck", "actions": [_action("move_arm", pose="tuck")]})
    assert stack.lockstep.run_until(lambda: joint_speeds(stack).max() > 0.4, 10.0)
    return command_id


def _action(skill: str, **parameters: object) -> dict[str, object]:
    return {"id": "a1", "skill": skill, "parameters": parameters}


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


@pytest.mark.parametrize("start", [drive_until_moving, reach_until_moving])
def test_when_control_dies_everything_stands_still_within_the_watchdog(
    stack: LockstepStack, start: object
) -> None:
    profile = load_profile("desktop")
    start(stack)  # type: ignore[operator]
    stack.lockstep.kill(stack.control)
    stack.lockstep.run_for(max(profile.bus_watchdog_s, profile.can_heartbeat_s) + 0.1)
    worst = 0.0
    for _ in range(100):
        worst = max(worst, float(joint_speeds(stack).max()))
        stack.lockstep.run_for(0.02)
    assert worst < STANDSTILL_RAD_S
    stack.restart_control()
    stack.lockstep.run_for(1.0)
    assert stack.status()["state"] == "disarmed"
