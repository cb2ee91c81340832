"""Read good commands, and say what is wrong with bad ones."""

from typing import Any

import pytest

from vla_deploy.control.motion.commands import (
    Cancel,
    CommandRefused,
    JointGoal,
    Waypoints,
    motion_id_of,
    parse_command,
)

INDEX = {"shoulder": 0, "elbow": 1, "gripper": 2}
GOAL: dict[str, Any] = {
    "kind": "goal",
    "motion_id": 4,
    "targets": {"elbow": 1.0, "gripper": 0.02},
    "speed_ratio": 0.5,
}
POINTS: dict[str, Any] = {
    "kind": "trajectory",
    "motion_id": 5,
    "joints": ["elbow", "shoulder"],
    "times_s": [0, 1.5],
    "positions": [[0.1, 0.2], [0.3, 0.4]],
}


def test_a_goal_names_its_joints_by_index() -> None:
    goal = parse_command({**GOAL, "effort_ratio": {"gripper": 0.25}}, INDEX)
    assert isinstance(goal, JointGoal)
    assert (goal.motion_id, goal.speed_ratio, goal.effort_ratio) == (4, 0.5, {2: 0.25})
    assert goal.axes.tolist() == [1, 2]
    assert goal.target.tolist() == [1.0, 0.02]
    assert goal.together
    alone = parse_command({**GOAL, "together": False}, INDEX)
    assert isinstance(alone, JointGoal)
    assert not alone.together


def test_a_trajectory_keeps_the_order_of_its_joints() -> None:
    points = parse_command(POINTS, INDEX)
    assert isinstance(points, Waypoints)
    assert points.axes.tolist() == [1, 0]
    assert points.positions.tolist() == [[0.1, 0.2], [0.3, 0.4]]


def test_a_cancel_needs_its_id_only() -> None:
    assert parse_command({"kind": "cancel", "motion_id": 7}, INDEX) == Cancel(motion_id=7)


@pytest.mark.parametrize(
    ("document", "message"),
    [
        ({**GOAL, "motion_id": "4"}, "motion_id: expected an integer"),
        ({**GOAL, "motion_id": True}, "motion_id: expected an integer"),
        ({**GOAL, "kind": None}, "kind: expected goal, trajectory, cancel or rest"),
        ({**GOAL, "targets": {}}, "at least one joint"),
        ({**GOAL, "together": 1}, "together: expected true or false, got 1"),
        ({**GOAL, "targets": [1.0]}, "targets: expected a value per joint"),
        ({**GOAL, "targets": {"knee": 1.0}}, "no joint knee; there are shoulder, elbow, gripper"),
        ({**GOAL, "targets": {"elbow": "up"}}, "elbow: expected a finite number"),
        ({**GOAL, "targets": {"elbow": float("nan")}}, "elbow: expected a finite number"),
        ({**GOAL, "speed_ratio": 0.0}, "speed_ratio: expected above 0"),
        ({**GOAL, "speed_ratio": 1.1}, "speed_ratio: expected above 0"),
        ({**GOAL, "effort_ratio": {"gripper": 2.0}}, "gripper: expected above 0"),
        ({**POINTS, "joints": []}, "joints: expected a list"),
        ({**POINTS, "joints": ["elbow", "elbow"]}, "different joints"),
        ({**POINTS, "times_s": "soon"}, "times_s: expected numbers"),
        ({**POINTS, "times_s": [[0.0]]}, "times_s: expected 1 dimensions"),
        ({**POINTS, "positions": [[0.1, 0.2], [0.3]]}, "positions: expected numbers"),
    ],
)
def test_a_bad_command_is_refused_with_the_key(document: dict[str, Any], message: str) -> None:
    with pytest.raises(CommandRefused, match=message):
        parse_command(document, INDEX)


def test_a_command_without_an_id_has_nobody_to_answer() -> None:
    assert motion_id_of({}) is None
    assert motion_id_of({"motion_id": 3}) == 3
