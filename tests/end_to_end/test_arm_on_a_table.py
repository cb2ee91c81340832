"""An arm is a robot: six servos on one bus, on a table, moved by joints and by words."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from platforms import load_profile
from sim_twin.faults.request import FaultRefused
from sim_twin.harness.lockstep_stack import LockstepControl, armed_lockstep
from sim_twin.harness.processes import armed_processes
from vla_deploy.ipc import topics
from vla_deploy.planning.node import PlannerNode
from vla_deploy.robots import load_robot
from vla_deploy.skills.node import ExecutorNode

DYNAMIXEL_ARMS = ("koch_v1_1", "omx", "wx250s")


@pytest.fixture
def arm(tmp_path: Path, request: pytest.FixtureRequest) -> Iterator[LockstepControl]:
    """Return an armed arm: an SO-101, where a test asks for none by name."""
    made = LockstepControl(tmp_path, robot=getattr(request, "param", "so101"))
    made.arm()
    yield made
    made.close()


def positions(arm: LockstepControl) -> dict[str, float]:
    joints = arm.lockstep.truth()["joints"]
    return {name: joints[name]["position"] for name in arm.robot.joint_names}


def test_it_leaves_its_rest_and_goes_to_its_poses(arm: LockstepControl) -> None:
    for name in ("folded", "ready", "folded"):
        arm.go(arm.robot.poses[name])
        arm.lockstep.run_for(3.0)
        assert arm.state() == "armed", arm.control_status()
        reached = positions(arm)
        for joint, value in arm.robot.poses[name].items():
            assert reached[joint] == pytest.approx(value, abs=0.02), (name, joint)
    assert not arm.lockstep.twin.hazards.found


def test_an_emergency_stop_in_motion_stands_and_holds(arm: LockstepControl) -> None:
    arm.go(arm.robot.poses["ready"])
    arm.lockstep.run_for(1.0)
    arm.operate("estop")
    arm.lockstep.run_for(0.6)
    stood = positions(arm)
    arm.lockstep.run_for(2.0)
    assert arm.control_status()["estop_latched"]
    assert positions(arm) == pytest.approx(stood, abs=0.01)


def test_a_dead_cable_leaves_it_where_it_passes_and_it_goes_on_after_a_reset(
    arm: LockstepControl,
) -> None:
    arm.go(arm.robot.poses["ready"])
    arm.lockstep.run_for(1.0)
    passing = positions(arm)
    arm.lockstep.twin.plugs["servos"].pull()
    arm.lockstep.run_for(2.0)
    assert arm.control_status()["cause"] == "servo_bus_lost"
    speeds = [abs(one["velocity"]) for one in arm.lockstep.truth()["joints"].values()]
    assert max(speeds) < 0.01, "no watchdog stops it: its last goal is where it stands"
    stood = positions(arm)
    assert stood == pytest.approx(passing, abs=0.1)
    arm.lockstep.twin.plugs["servos"].push()
    arm.lockstep.run_for(2.5)
    assert positions(arm) == pytest.approx(stood, abs=0.01), "it goes on to no setpoint"
    arm.arm()
    arm.go(arm.robot.poses["ready"])
    arm.lockstep.run_for(3.0)
    assert positions(arm)["wrist_flex"] == pytest.approx(1.501, abs=0.02)


def test_a_servo_that_is_too_hot_stops_it_and_is_named(arm: LockstepControl) -> None:
    arm.go(arm.robot.poses["ready"])
    arm.lockstep.run_for(3.0)
    arm.lockstep.twin.servos.set_alert(3, 4)
    arm.lockstep.run_for(1.0)
    assert arm.state() == "stopped"
    assert "elbow_flex" in str(arm.control_status())


@pytest.mark.parametrize("component", ["lidar", "imu", "can_bus", "drive"])
def test_what_it_does_not_have_cannot_fail(arm: LockstepControl, component: str) -> None:
    with pytest.raises(FaultRefused, match=r"the robot file has no \["):
        arm.faults.inject(component, None, "off" if component == "drive" else "unplug")


@pytest.mark.slow
@pytest.mark.gl
@pytest.mark.parametrize("name", ["so101", "koch_v1_1", "omx", "wx250s"])
def test_every_arm_puts_the_red_block_into_the_bowl(tmp_path: Path, name: str) -> None:
    with armed_lockstep(tmp_path, robot=name) as stack:
        ended = stack.say(stack.robot.twin.demo)
        assert ended.get("success"), ended
        stack.lockstep.run_for(1.0)
        assert stack.lockstep.inside("red_block", "bowl")["inside"]


class Talking:
    """The arm with executor and planner, told in words."""

    def __init__(self, arm: LockstepControl) -> None:
        self.arm = arm
        context, profile = arm.lockstep.context, load_profile("desktop")
        arm.lockstep.add(ExecutorNode(context, arm.robot, profile.executor_rate_hz))
        arm.lockstep.add(PlannerNode(context, arm.robot))
        self._events = arm.link.events(topics.TASK_EVENT, from_start=True)
        self._number = 0

    def say(self, text: str) -> dict[str, Any]:
        """Give a command and return its last event."""
        self._number += 1
        command_id = f"c{self._number}"
        self.arm.link.writer(topics.UTTERANCE).publish(
            {"command_id": command_id, "text": text, "source": "test"}
        )
        ends: list[dict[str, Any]] = []

        def has_ended() -> bool:
            told = [{**event.payload} for event in self._events.drain()]
            ends.extend(
                one
                for one in told
                if one["command_id"] == command_id and one["event"] in ("finished", "rejected")
            )
            return bool(ends)

        assert self.arm.wait_until(has_ended, 30.0), text
        return ends[-1]


def test_words_move_it_and_what_it_lacks_is_named(arm: LockstepControl) -> None:
    talking = Talking(arm)
    ended = talking.say("tuck your arm")
    assert ended.get("success"), ended
    assert positions(arm) == pytest.approx(arm.robot.poses["folded"], abs=0.06)
    arm.go(arm.robot.poses["ready"])
    arm.lockstep.run_for(3.0)
    assert talking.say("open the gripper")["success"]
    wide = positions(arm)["gripper"]
    assert talking.say("close the gripper")["success"]
    assert wide - positions(arm)["gripper"] > 1.5
    assert talking.say("wait one second and then stop")["success"]
    assert "so101 has no base" in str(talking.say("turn left"))
    assert "I have no head to turn" in str(talking.say("look down"))
    assert "I know: table" in str(talking.say("go to the kitchen"))
    assert np.isfinite(list(positions(arm).values())).all()


@pytest.mark.parametrize("arm", DYNAMIXEL_ARMS, indirect=True)
def test_a_dynamixel_arm_moves_by_joints_and_by_words_and_stands_at_an_emergency_stop(
    arm: LockstepControl,
) -> None:
    ready, limits = arm.robot.poses["ready"], arm.robot.limits["gripper"]
    arm.go(ready)
    arm.lockstep.run_for(2.0)
    assert positions(arm) == pytest.approx(ready, abs=0.02)
    talking = Talking(arm)
    assert talking.say("open the gripper")["success"]
    assert positions(arm)["gripper"] == pytest.approx(limits.max, abs=0.05)
    assert f"{arm.robot.name} has no base" in str(talking.say("turn left"))
    arm.go(arm.robot.poses["folded"])
    arm.lockstep.run_for(0.5)
    arm.operate("estop")
    arm.lockstep.run_for(0.6)
    stood = positions(arm)
    arm.lockstep.run_for(0.5)
    assert arm.control_status()["estop_latched"]
    assert positions(arm) == pytest.approx(stood, abs=0.01)
    # Goals move every other step of the physics, of which the D term makes a ripple in the speed.
    assert {one.kind for one in arm.lockstep.twin.hazards.found} <= {"joint speed"}


@pytest.mark.parametrize("arm", ["koch_v1_1"], indirect=True)
def test_servos_of_two_supplies_measure_their_own_and_stop_the_arm_when_one_sags(
    arm: LockstepControl,
) -> None:
    assert arm.control_status()["joints"]["voltage_v"] == [12.0, 12.0, 5.0, 5.0, 5.0, 5.0]
    with pytest.raises(FaultRefused, match=r"supply: expected 0..2"):
        arm.faults.inject("servo_bus", None, "brown_out", supply=3)
    arm.faults.inject("servo_bus", None, "brown_out", volts_v=3.6, supply=2)
    arm.lockstep.run_for(0.5)
    status = arm.control_status()
    assert (status["cause"], status["subject"]) == ("joint_voltage_limit", "elbow_flex")
    assert status["joints"]["voltage_v"] == [12.0, 12.0, 3.6, 3.6, 3.6, 3.6]


@pytest.mark.stack
def test_its_processes_are_those_that_it_has_use_for(
    tmp_path_factory: pytest.TempPathFactory,
) -> None:
    options = ("--fast", "--robot", "so101")
    with armed_processes(tmp_path_factory.mktemp("arm") / "base", *options) as run:
        rows = {row["name"]: row for row in run.status()["process_table"]["processes"]}
        off = {name: row["reason"] for name, row in rows.items() if row["state"] == "off"}
        assert off["speech"] == "so101 has no microphone and no speaker"
        assert set(off) == {"speech", "ros"}
        moved = run.ask("joint", "move", "shoulder_pan", "--to", "0.5")
        assert moved.returncode == 0, moved.stderr
        assert run.truth()["joints"]["shoulder_pan"]["position"] == pytest.approx(0.5, abs=0.02)
        ended = run.say("go to the ready pose")
        assert ended.get("success"), ended
        assert run.truth()["joints"]["elbow_flex"]["position"] == pytest.approx(
            load_robot("so101").poses["ready"]["elbow_flex"], abs=0.06
        )
        assert run.say("open the gripper")["success"]
        assert "so101 has no base" in run.say("drive forward one metre")["reason"]
