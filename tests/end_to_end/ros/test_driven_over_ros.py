"""A program that knows nothing of ours drives the twin over ROS 2: real rclpy, real processes."""

import re
from collections.abc import Callable
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import pytest

from drivers.clock import NS_PER_S
from sim_twin.harness.processes import ProcessStack
from vla_deploy.gateways.ros.shared_memory import YOUNG_S

pytestmark = [pytest.mark.stack, pytest.mark.gl, pytest.mark.timeout(900)]

CLIENT = (Path(__file__).parents[3] / "docs/examples/ros_client.py").read_text(encoding="utf-8")
REFUSED = -1
JOINTS = -2
OLD = -3
PATH = -4
GOAL = -5


@pytest.fixture
def client(robot: ProcessStack, ros_graph: Any) -> Callable[[str], Any]:
    return lambda case: ros_graph.run(CLIENT, case, timeout_s=600.0)


def segments_of(pid: int) -> set[Path]:
    """Return the shared memory that a process itself made for Fast DDS: its locks are open."""
    opened = {str(one.readlink()) for one in Path(f"/proc/{pid}/fd").iterdir() if one.is_symlink()}
    own = (re.fullmatch(r"(/dev/shm/fastrtps_[0-9a-f]{16})_el", one) for one in opened)
    return {Path(one[1]) for one in own if one}


def age_s(file: Path) -> float:
    return datetime.now(UTC).timestamp() - file.stat().st_mtime


def ended(told: dict[str, Any]) -> tuple[str, int]:
    return told["status"], told["result"]["error_code"]


def test_trajectories_end_as_the_fields_own_controller_ends_them(
    client: Callable[[str], Any],
) -> None:
    told = client("trajectories")
    assert told["done"]["status"] == "succeeded"
    assert told["done"]["feedback"] > 5
    assert told["reached"] == pytest.approx([0.5, 0.2], abs=0.05)
    assert ended(told["off_path"]) == ("aborted", PATH), told["off_path"]
    assert "head_pan is" in told["off_path"]["result"]["error_string"]
    assert ended(told["off_goal"]) == ("aborted", GOAL), told["off_goal"]
    assert told["superseded"]["status"] == "aborted"
    assert "newer goal" in told["superseded"]["result"]["error_string"]
    assert told["second"]["status"] == "succeeded"
    assert told["last"] == pytest.approx([0.0, 0.2], abs=0.05)
    assert told["cancelled"]["status"] == "canceled"
    assert told["cancelled"]["cancelled"] == 1
    assert told["stopped_at"] < 0.7


def test_what_cannot_be_is_refused_with_code_and_words_and_nothing_moves(
    client: Callable[[str], Any],
) -> None:
    answer = client("refusals")
    told = answer["told"]
    assert answer["moved"] < 0.02
    assert all(one["status"] == "aborted" for one in told.values()), told
    codes = {name: one["result"].get("error_code") for name, one in told.items()}
    expected = {
        **dict.fromkeys(("unknown_joint", "joint_twice", "joint_missing", "long_name"), JOINTS),
        **dict.fromkeys(
            ("no_points", "sizes", "nan", "backwards", "many", "beyond", "fast", "future"), REFUSED
        ),
        "stale": OLD,
    }
    assert {name: codes[name] for name in expected} == expected
    silent = ("gripper",)  # GripperCommand has no words
    for name, one in told.items():
        words = [value for value in one["result"].values() if isinstance(value, str) and value]
        assert words or name in silent, name
    assert all(codes[name] for name in codes if name.startswith(("navigate_", "plan_"))), codes


def test_both_gripper_actions_move_the_hand(client: Callable[[str], Any]) -> None:
    told = client("grippers")
    assert told["classic"]["status"] == told["parallel"]["status"] == "succeeded"
    assert told["classic"]["result"]["reached_goal"]
    assert told["gap_m"] == pytest.approx(0.06, abs=0.004)
    assert told["gap_then_m"] == pytest.approx(0.03, abs=0.004)


def test_streamed_positions_are_followed_and_bad_ones_are_not(
    client: Callable[[str], Any],
) -> None:
    told = client("joint_commands")
    assert told["reached"] == pytest.approx(0.4, abs=0.03)
    assert told["then"] == pytest.approx(told["reached"], abs=0.01)


def test_a_pose_is_driven_to_with_feedback_and_cancelled_on_the_way(
    client: Callable[[str], Any],
) -> None:
    told = client("navigation")
    assert told["on_the_way"]["status"] == "canceled"
    assert told["on_the_way"]["cancelled"] == 1
    assert told["left_m"][0] > told["left_m"][-1] > 3.0
    assert told["still"]
    assert told["near"]["status"] == "succeeded"
    assert told["drove_m"] == pytest.approx(0.4, abs=0.06)


def test_a_dead_sender_of_velocities_leaves_a_base_that_stands_within_half_a_second(
    robot: ProcessStack, client: Callable[[str], Any], ros_graph: Any
) -> None:
    assert client("bad_velocity")["moved_m"] == pytest.approx(0.0, abs=0.002)
    sender = ros_graph.start(CLIENT, "velocity", "-0.5")
    assert sender.stdout.readline() == "driving\n"
    base = lambda: robot.session.fresh("base_state").data  # noqa: E731
    assert robot.wait_until(lambda: base()["v_m_s"] < -0.45)
    sender.kill()
    sender.wait()
    told = robot.session.fresh("remote_base_command").stamp_ns
    assert robot.wait_until(lambda: abs(base()["v_m_s"]) < 0.01)
    took_s = (robot.session.fresh("base_state").stamp_ns - told) / NS_PER_S
    assert took_s < 0.5
    assert robot.state() == "armed"


@pytest.mark.parametrize(
    "hit", [ProcessStack.kill, pytest.param(ProcessStack.freeze, marks=pytest.mark.slow)]
)
def test_a_dead_or_frozen_gateway_leaves_a_safe_robot_and_comes_back(
    robot: ProcessStack,
    ros_graph: Any,
    client: Callable[[str], Any],
    hit: Callable[[ProcessStack, str], None],
) -> None:
    gateway = robot.row("ros")["pid"]
    segments = segments_of(gateway)
    assert segments
    # A segment that is younger could be one whose owner has not locked it yet: it is let be.
    assert robot.wait_until(lambda: min(map(age_s, segments)) > YOUNG_S)
    sender = ros_graph.start(CLIENT, "velocity", "0.4")
    assert sender.stdout.readline() == "driving\n"
    follower = ros_graph.start(CLIENT, "watched_goal")
    assert follower.stdout.readline() == "following\n"
    base = lambda: robot.session.fresh("base_state").data  # noqa: E731
    assert robot.wait_until(lambda: base()["v_m_s"] > 0.3)
    late = robot.document("control_status")["late_ticks"]
    hit(robot, "ros")
    assert robot.wait_until(lambda: abs(base()["v_m_s"]) < 0.01)
    sender.kill()
    assert robot.is_back("ros", gateway)
    assert robot.state() == "armed"
    assert robot.wait_until(lambda: not robot.document("control_status")["active_motions"], 5.0)
    assert robot.document("control_status")["late_ticks"] == late
    assert not [one for one in segments if one.exists()], "left in shared memory"
    assert client("grippers")["classic"]["status"] == "succeeded"


@pytest.mark.slow
def test_words_pick_up_and_put_down(robot: ProcessStack, client: Callable[[str], Any]) -> None:
    told = client("pick_and_place")
    assert told["done"]["status"] == "succeeded", told["done"]["result"]
    result = told["done"]["result"]
    assert result["success"]
    assert result["total_actions"] == result["successful_actions"] > 2
    assert ["pick_up", "succeeded"] in told["states"]
    assert robot.inside("red_cup", "box")["inside"]


def test_words_become_a_plan_in_the_documents_form(client: Callable[[str], Any]) -> None:
    (turn,) = client("words")["plan"]
    assert turn["action_type"] == "turn_left"
    assert turn["parameters"] == {"angle": 20.0}


def test_each_act_is_its_own_and_no_goal_arms_the_robot(client: Callable[[str], Any]) -> None:
    told = client("acts")
    assert told["estop"]["success"]
    assert not told["arm_latched"]["success"]
    assert "reset" in told["arm_latched"]["message"]
    assert told["reset"]["success"]
    for goal in ("goal", "drive", "plan"):
        assert told[goal]["status"] == "aborted"
        assert "arm it first" in str(told[goal]["result"])
    assert told["arm"]["success"]
    assert not told["arm_pressed"]["success"]
    assert told["reset_again"]["success"]
    assert told["arm_at_last"]["success"]
