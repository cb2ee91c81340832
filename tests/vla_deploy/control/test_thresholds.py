"""Hold the thresholds to what they are derived from."""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from drivers.clock import MonotonicClock
from vla_deploy.control.judging.input_collector import BudgetWatch
from vla_deploy.control.judging.thresholds import safety_limits
from vla_deploy.control.reporting.status_document import verdict_document
from vla_deploy.ipc import SharedSpace
from vla_deploy.robots import load_robot
from vla_deploy.robots.protection import NOTHING_DECLARED
from vla_deploy.safety import CLEAR, Cause, Direction, Reaction, Verdict

ROBOT = load_robot("butler")
LIMITS = safety_limits(ROBOT)
JOINT = ROBOT.joint_index


def test_a_servo_is_stopped_before_its_own_shutdown() -> None:
    assert LIMITS.temperature_c[JOINT["left_elbow"]] == 75.0  # XM430: 80
    assert LIMITS.temperature_c[JOINT["head_pan"]] == 67.0  # XL430: 72
    assert LIMITS.voltage_min_v[JOINT["left_elbow"]] == pytest.approx(9.8)
    assert LIMITS.voltage_min_v[JOINT["left_gripper"]] == pytest.approx(6.3)
    assert LIMITS.voltage_max_v[JOINT["head_pan"]] == pytest.approx(13.7)


def test_a_gripper_may_be_blocked_and_an_arm_may_not() -> None:
    assert np.isinf(LIMITS.following_error[JOINT["left_gripper"]])
    assert LIMITS.following_error[JOINT["left_elbow"]] == 0.4


def test_what_a_robot_file_does_not_declare_is_not_judged() -> None:
    bare = safety_limits(replace(ROBOT, protection=NOTHING_DECLARED))
    assert np.isinf(bare.external_torque_nm).all()
    assert bare.tip_margin_ratio == 0.0


def test_senses_are_missed_only_where_something_is_judged_by_them() -> None:
    assert (LIMITS.depth_age_s, LIMITS.pose_age_s, LIMITS.imu_age_s) == (1.0, 0.5, 0.5)
    home = replace(ROBOT.home, zones=())
    parts = replace(ROBOT.parts, home=home)
    bare = safety_limits(replace(ROBOT, protection=NOTHING_DECLARED, parts=parts))
    assert {bare.depth_age_s, bare.pose_age_s, bare.imu_age_s} == {np.inf}


def test_every_declared_contact_torque_reaches_its_joint() -> None:
    contact = ROBOT.protection.contact
    assert contact is not None
    for joint, torque_nm in contact.torque_nm.items():
        assert LIMITS.external_torque_nm[JOINT[joint]] == torque_nm


@pytest.fixture
def space(tmp_path: Path) -> SharedSpace:
    return SharedSpace(tmp_path, MonotonicClock())


@pytest.fixture
def budget(space: SharedSpace) -> Iterator[BudgetWatch]:
    watched = BudgetWatch(space.cell_reader("budget_stop"))
    yield watched
    watched.close()


@pytest.mark.parametrize(
    ("told", "reason"),
    [
        ({"stop": True, "reason": "memory"}, "memory"),
        ({"stop": True, "reason": ""}, "a budget is exhausted"),
        ({"stop": True}, "a budget is exhausted"),
        ({"stop": False, "reason": "memory"}, None),
        ({}, None),
    ],
)
def test_a_budget_demands_a_stop_until_it_says_otherwise(
    space: SharedSpace, budget: BudgetWatch, told: dict[str, Any], reason: str | None
) -> None:
    cell = space.cell_writer("budget_stop")
    assert budget.reason() is None
    cell.put_document(told)
    assert budget.reason() == reason
    assert budget.reason() == reason
    cell.put_document({"stop": False})
    assert budget.reason() is None


def test_a_verdict_is_told_in_plain_words_and_numbers() -> None:
    verdict = Verdict(
        reaction=Reaction.BASE_BLOCK,
        cause=Cause.OBSTACLE_STOP_ZONE,
        subject="contact",
        measured=0.25,
        age_s=np.inf,
        speed_ratio=0.5,
        blocked=frozenset({Direction.TURN_LEFT, Direction.FORWARD}),
    )
    assert verdict_document(verdict) == {
        "cause": "obstacle_stop_zone",
        "reaction": "base_block",
        "subject": "contact",
        "measured": 0.25,
        "limit": None,
        "age_s": None,
        "speed_ratio": 0.5,
        "blocked": ["forward", "turn_left"],
    }
    assert verdict_document(CLEAR)["cause"] == ""
