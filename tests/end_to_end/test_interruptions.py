"""What happens in the middle of picking and placing: a stop, a thing taken away, a restart."""

import numpy as np
import pytest

from sim_twin.harness.lockstep_stack import LockstepStack

pytestmark = [pytest.mark.gl, pytest.mark.timeout(240)]

COMMAND = "pick up the red cup and put it in the box"
STANDSTILL_RAD_S = 0.02
REST_WITHIN_S = 1.0
AWAY_M = (6.3, 4.4, 0.5475)


def fastest(stack: LockstepStack) -> float:
    joints = stack.lockstep.truth()["joints"]
    return max(abs(joint["velocity"]) for joint in joints.values())


def run_into(stack: LockstepStack, skill: str, seconds: float) -> str:
    """Give the main command and return its id some time into the skill of that name."""
    before = len(stack.events)
    command_id = stack.give(text=COMMAND)

    def began() -> bool:
        assert stack.outcome(command_id) is None, stack.outcome(command_id)
        return any(
            event["event"] == "action" and event["skill"] == skill and event["status"] == "active"
            for event in stack.events[before:]
        )

    assert stack.lockstep.run_until(began, 120.0)
    stack.lockstep.run_until(lambda: stack.outcome(command_id) is not None, seconds)
    return command_id


def stop_and_check(stack: LockstepStack) -> None:
    """Stop; the robot must rest within a second and do the next command."""
    stack.say("stop")
    assert stack.lockstep.run_until(lambda: fastest(stack) < STANDSTILL_RAD_S, REST_WITHIN_S)
    stack.lockstep.run_for(0.2)
    assert fastest(stack) < STANDSTILL_RAD_S
    assert stack.say("turn left 15 degrees")["success"]


def holding(stack: LockstepStack) -> dict[str, str | None]:
    sample = stack.space.cell_reader("executor_status").latest()
    assert sample is not None
    held: dict[str, str | None] = sample.document()["holding"]
    return held


def test_a_stop_while_grasping_leaves_the_robot_ready(coarse_at_table: LockstepStack) -> None:
    stack = coarse_at_table
    run_into(stack, "pick_up", 4.5)
    stop_and_check(stack)


@pytest.mark.slow
@pytest.mark.timeout(900)
def test_stops_at_random_moments_of_pick_and_place_leave_the_robot_ready(
    stack: LockstepStack,
) -> None:
    random = np.random.default_rng(2)
    for skill, longest_s in (("pick_up", 7.5), ("place", 6.0)):
        for _ in range(3):
            run_into(stack, skill, float(random.uniform(0.2, longest_s)))
            stop_and_check(stack)
    outcome = stack.say(COMMAND)
    cup = stack.lockstep.inside("red_cup", "box")
    assert cup["inside"] or not outcome["success"]


def test_fingers_that_close_on_nothing_are_reported(coarse_at_table: LockstepStack) -> None:
    stack = coarse_at_table
    command_id = run_into(stack, "pick_up", 4.0)
    stack.lockstep.twin.engine.place("red_cup", *AWAY_M, 0.0)
    stack.lockstep.kill(stack.planner)  # which would have it looked for in every room
    assert stack.lockstep.run_until(lambda: stack.outcome(command_id) is not None, 60.0)
    outcome = stack.outcome(command_id)
    assert outcome is not None
    assert not outcome["success"]
    assert "no longer where I saw it" in outcome["error"]
    told = [str(event.get("error")) for event in stack.events if event["event"] == "action"]
    assert any("does not hold the red cup: fingers" in error for error in told)
    assert set(holding(stack).values()) == {None}
    tuck = stack.robot.poses["tuck"]
    joints = stack.lockstep.truth()["joints"]
    assert all(joints[name]["position"] == pytest.approx(tuck[name], abs=0.1) for name in tuck)


def pause_at(stack: LockstepStack, command_id: str, skill: str, seconds: float) -> None:
    """Pause some time into a skill for 3 s: all rests, and the hands hold what they hold."""

    def began() -> bool:
        assert stack.outcome(command_id) is None, stack.outcome(command_id)
        return any(
            event["event"] == "action" and event["skill"] == skill and event["status"] == "active"
            for event in stack.events
        )

    assert stack.lockstep.run_until(began, 120.0)
    stack.lockstep.run_for(seconds)
    held = holding(stack)
    stack.give(pause=True)
    assert stack.lockstep.run_until(lambda: fastest(stack) < STANDSTILL_RAD_S, 2.0)
    stack.lockstep.run_for(1.0)
    at = stack.lockstep.truth()["joints"]
    stack.lockstep.run_for(1.0)
    later = stack.lockstep.truth()["joints"]
    moved = {name: abs(later[name]["position"] - at[name]["position"]) for name in at}
    assert max(moved.values()) < 0.01, max(moved.items(), key=lambda one: one[1])
    assert holding(stack) == held
    stack.give(pause=False)


def test_a_job_that_is_paused_in_its_phases_comes_to_the_same_end(
    coarse_at_table: LockstepStack,
) -> None:
    stack = coarse_at_table
    command_id = stack.give(text=COMMAND)
    for skill, seconds in (("pick_up", 1.0), ("pick_up", 0.8), ("pick_up", 1.5), ("place", 2.0)):
        pause_at(stack, command_id, skill, seconds)
    assert stack.lockstep.run_until(lambda: stack.outcome(command_id) is not None, 120.0)
    outcome = stack.outcome(command_id)
    assert outcome is not None
    assert outcome["success"], outcome
    assert stack.lockstep.inside("red_cup", "box")["inside"]
