"""A whole robot on the twin's time, driven and moved by servers in processes of their own."""

import json
import math
import os
import signal
import subprocess
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from sim_twin.harness.processes import ProcessStack
from vla_deploy.robots import load_robot
from vla_deploy.supervisor.processes.ros_environment import RosEnvironment

# Two robots and their servers, killed in turn: with `make campaign`, not with every test run.
pytestmark = [pytest.mark.slow, pytest.mark.stack, pytest.mark.gl, pytest.mark.timeout(900)]

STANDSTILL_RAD_S = 0.05
MOVING_RAD_S = 1.0
LEFT_ARM = "left_arm_controller/follow_joint_trajectory"
RIGHT_ARM = "right_arm_controller/follow_joint_trajectory"


class Robot(ProcessStack):
    """The robot, and a folder for its plans."""

    def carry_out(self, *actions: dict[str, Any]) -> "subprocess.Popen[str]":
        """Give it a plan; its outcome comes on standard output."""
        plan = self.base / "plan.json"
        plan.write_text(json.dumps({"goal": "test", "actions": list(actions)}))
        return self.begin("say", "--json", "--plan", str(plan))

    def is_driven(self) -> bool:
        """Return whether the wheels turn, but not how the arms move."""
        return max(map(abs, self.wheels_rad_s())) > MOVING_RAD_S

    def wheels_rad_s(self) -> list[float]:
        """Return the wheels' speeds."""
        joints = self.truth()["joints"]
        return [joints[name]["velocity"] for name in ("left_wheel", "right_wheel")]

    def stands(self, timeout_s: float) -> bool:
        """Return whether the base comes to rest in time, of the twin's."""
        return self.wait_until(
            lambda: max(map(abs, self.wheels_rad_s())) < STANDSTILL_RAD_S, timeout_s
        )


def drive_to(x_m: float, y_m: float, yaw_rad: float = 0.0) -> dict[str, Any]:
    parameters = {"x_m": x_m, "y_m": y_m, "yaw_rad": yaw_rad}
    return {"id": "a1", "skill": "navigate_to", "parameters": parameters}


def outcome(saying: "subprocess.Popen[str]") -> dict[str, Any]:
    out, complaint = saying.communicate(timeout=600)
    assert out, complaint
    told: dict[str, Any] = json.loads(out)
    return told


def action(saying: "subprocess.Popen[str]") -> dict[str, Any]:
    (only,) = outcome(saying)["actions"]
    return dict(only)


@pytest.fixture(scope="module")
def robot(
    ros_environment: RosEnvironment, ros_domain: int, make_robot_folder: Any
) -> Iterator[Robot]:
    assert ros_environment  # else the module is skipped
    with tempfile.TemporaryDirectory(prefix="vla-") as folder:  # sockets want a short path
        described = make_robot_folder(Path(folder) / "butler", f"domain_id = {ros_domain}\n")
        started = Robot(Path(folder) / "base", "--robot", str(described), "--profile", "desktop")
        try:
            started.wait_until_armed()
            assert started.wait_until(lambda: started.document("ros_status", 2.0))
            yield started
        finally:
            started.close()


@pytest.fixture
def arms(serve: Any) -> None:
    """Have servers move the arms, each by the robot's own server."""
    serve("fjt", LEFT_ARM, "relay")
    serve("fjt", RIGHT_ARM, "relay")


def test_servers_drive_the_base_and_move_the_arms(robot: Robot, serve: Any, arms: None) -> None:
    nav = serve("nav", "navigate_to_pose", "drive")
    told = outcome(robot.carry_out(drive_to(1.0, 2.45, 0.3)))
    assert told["success"], told
    truth = robot.truth()["robot"]
    assert math.hypot(truth["x_m"] - 1.0, truth["y_m"] - 2.45) < 0.15, truth
    assert [nav.stdout.readline() for _ in range(2)] == ["goal\n", "there\n"]
    tucked = load_robot("butler").poses["tuck"]  # they hung down before
    joints = robot.truth()["joints"]
    off = [abs(joints[name]["position"] - value) for name, value in tucked.items()]
    assert max(off) < 0.1


def test_a_server_that_goes_on_after_its_cancel_moves_nothing(
    robot: Robot, serve: Any, arms: None
) -> None:
    nav = serve("nav", "navigate_to_pose", "drive_on")
    saying = robot.carry_out(drive_to(0.5, 2.5, 3.0))
    assert robot.wait_until(robot.is_driven)
    robot.operate("stop")
    assert robot.stands(2.0)
    told = action(saying)
    assert told["status"] == "cancelled"
    assert "rejected the cancel" in told["note"]
    assert not robot.wait_until(robot.is_driven, 2.0)
    assert [nav.stdout.readline() for _ in range(2)] == ["goal\n", "cancel\n"]


@pytest.mark.parametrize(
    ("mode", "status", "retries"), [("reject", "rejected", 0), ("abort", "aborted", 1)]
)
def test_what_a_server_says_is_the_status_of_the_action(
    robot: Robot, serve: Any, arms: None, mode: str, status: str, retries: int
) -> None:
    serve("nav", "navigate_to_pose", mode)
    told = action(robot.carry_out(drive_to(1.2, 2.5)))
    assert (told["status"], told["retries"]) == (status, retries), told


def test_an_action_whose_gateway_is_killed_is_lost_and_the_base_stops(
    robot: Robot, serve: Any, arms: None
) -> None:
    serve("nav", "navigate_to_pose", "drive")
    saying = robot.carry_out(drive_to(1.3, 2.6, 0.0))
    assert robot.wait_until(robot.is_driven)
    robot.kill("ros")
    assert robot.stands(2.0)
    told = outcome(saying)
    assert [one["status"] for one in told["actions"]] == ["lost"]
    assert "the ROS gateway" in told["error"]
    assert robot.wait_until(lambda: robot.row("ros")["state"] == "ready")
    assert not robot.wait_until(robot.is_driven, 2.0), "a goal of before drives the base again"


def test_the_base_stops_when_its_server_or_the_executor_is_killed(
    robot: Robot, serve: Any, arms: None
) -> None:
    nav = serve("nav", "navigate_to_pose", "drive")
    saying = robot.carry_out(drive_to(0.7, 2.45, 0.0))
    assert robot.wait_until(robot.is_driven)
    os.kill(nav.pid, signal.SIGKILL)
    assert robot.stands(2.0)
    robot.operate("stop")
    assert action(saying)["status"] == "cancelled"
    again = serve("nav", "navigate_to_pose", "drive")
    robot.carry_out(drive_to(0.7, 2.45, 0.0))
    assert robot.wait_until(robot.is_driven)
    robot.kill("executor")
    assert robot.stands(2.0)
    assert [again.stdout.readline() for _ in range(3)] == ["goal\n", "cancel\n", "canceled\n"]
