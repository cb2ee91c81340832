"""A leader is a robot that is only read: its joints are published, and it never has torque."""

import shutil
import tomllib
from collections.abc import Iterator
from pathlib import Path

import pytest

from platforms import load_profile
from sim_twin.harness.lockstep_stack import LockstepControl
from sim_twin.ports.lines import MemoryLine
from vla_deploy.client.readiness import refusal_of
from vla_deploy.control.node import ControlNode
from vla_deploy.robots import RobotFileError, load_robot
from vla_deploy.robots.loader import ROBOT_FILE, ROBOTS_DIR
from vla_deploy.robots.servos.declared import bus_family

NAMES = ("so101_leader", "koch_v1_1_leader")


@pytest.fixture(params=NAMES)
def leader(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[LockstepControl]:
    made = LockstepControl(tmp_path, robot=request.param)
    made.lockstep.run_for(0.1)
    yield made
    made.close()


def test_a_hand_moves_it_and_nothing_else_does(leader: LockstepControl) -> None:
    robot, bank = leader.robot, leader.lockstep.twin.servos
    refusal = f"{robot.name} is a leader: it is only read"
    results = leader.space.ring_reader("motion_result", from_start=True)
    leader.link.operate("arm")
    motion = {"kind": "goal", "motion_id": 7, "targets": {"wrist_roll": 0.5}, "speed_ratio": 1.0}
    leader.space.ring_writer("motion_command").publish(motion)
    leader.lockstep.twin.engine.pose({"shoulder_pan": 0.7})
    leader.lockstep.run_for(0.3)
    sample = leader.link.fresh("joint_state")
    assert sample is not None
    assert sample.data["position"][0] == pytest.approx(0.7, abs=0.02)
    status = leader.link.fresh("control_status").document()
    assert status["state"] == "disarmed"
    assert f"arm refused: {refusal}" in status["detail"]
    assert refusal_of(status) == refusal
    assert [(one.payload["status"], one.payload["reason"]) for one in results.drain()] == [
        ("refused", refusal)
    ]
    assert not any(bank.register(one.id, "torque_enable") for one in robot.servo_bus.servos)


def test_one_that_holds_is_let_go_at_the_start(leader: LockstepControl) -> None:
    """So LeRobot leaves the trigger of a Koch."""
    step = leader.lockstep
    step.remove(leader.control)
    bus = leader.robot.servo_bus
    bench = bus_family(leader.robot).bench(
        MemoryLine(step.twin.servos, step.clock), step.clock, bus.baud
    )
    bench.drive(bench.servo(6), 1.0).hold()
    assert step.twin.servos.register(6, "torque_enable")
    step.add(ControlNode(step.context, leader.robot, load_profile("desktop"), step.devices))
    step.run_for(0.1)
    assert not step.twin.servos.register(6, "torque_enable")


@pytest.mark.parametrize("name", NAMES)
def test_its_joints_are_those_of_the_arm_that_follows(name: str) -> None:
    leader, follower = load_robot(name), load_robot(name.removesuffix("_leader"))
    assert leader.joint_names == follower.joint_names
    assert leader.mjcf_path == follower.mjcf_path
    assert leader.folder != follower.folder


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("stop_category = 0", "stop_category = 2", "0, no power: the robot is only read"),
        (
            "[poses.rest]",
            "[calibration.against_stops]\ngripper = { torque_ratio = 0.2, speed_rad_s = 0.5 }\n"
            "[poses.rest]",
            "nothing: the robot is only read",
        ),
        ("so101/so101.xml", "so102/so102.xml", "a file under"),
    ],
)
def test_what_would_give_it_torque_is_a_fault(
    tmp_path: Path, old: str, new: str, words: str
) -> None:
    folder = Path(shutil.copytree(ROBOTS_DIR / "so101_leader", tmp_path / "mine"))
    assert load_robot(folder).mjcf_path.name == "so101.xml", "a copy finds the MJCF, too"
    file = folder / ROBOT_FILE
    text = file.read_text(encoding="utf-8").replace(old, new)
    assert tomllib.loads(text)["read_only"]
    file.write_text(text, encoding="utf-8")
    with pytest.raises(RobotFileError, match=words):
        load_robot(folder)
