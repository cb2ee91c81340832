"""Hold power to the stop categories of the robot file, and gravity to the servos' stiffness."""

from dataclasses import replace

import numpy as np
import pytest

from vla_deploy.control.modes.stop_plan import StopPlan
from vla_deploy.control.output.gravity import GravityOffset, stiffness
from vla_deploy.robots import RobotDescription, load_robot
from vla_deploy.robots.description import StopCategory
from vla_deploy.robots.kinematics.model import RobotModel
from vla_deploy.safety import Reaction


@pytest.fixture(scope="module")
def robot() -> RobotDescription:
    return load_robot("butler")


def names(robot: RobotDescription, joints: np.ndarray[tuple[int], np.dtype[np.intp]]) -> set[str]:
    return {robot.joint_names[joint] for joint in joints}


def with_head(robot: RobotDescription, category: StopCategory) -> RobotDescription:
    head = replace(robot.groups["head"], stop_category=category)
    return replace(robot, groups={**robot.groups, "head": head})


def test_an_estop_takes_power_from_category_1_at_rest_only(robot: RobotDescription) -> None:
    plan = StopPlan(with_head(robot, StopCategory.STOP_THEN_REMOVE_POWER))
    assert len(plan.unpowered_at_once(Reaction.GROUP_STOP)) == 0
    head = {"head_pan", "head_tilt"}
    assert names(robot, plan.unpowered_at_rest(Reaction.GROUP_STOP)) == head
    assert names(robot, plan.released()) == head
    assert plan.base_category(Reaction.GROUP_STOP) is StopCategory.STOP_THEN_REMOVE_POWER


def test_an_estop_takes_power_from_category_0_at_once(robot: RobotDescription) -> None:
    plan = StopPlan(with_head(robot, StopCategory.POWER_REMOVED))
    head = {"head_pan", "head_tilt"}
    assert names(robot, plan.unpowered_at_once(Reaction.GROUP_STOP)) == head


def test_butler_holds_every_joint_through_an_estop(robot: RobotDescription) -> None:
    plan = StopPlan(robot)
    assert len(plan.unpowered_at_rest(Reaction.GROUP_STOP)) == 0


def test_a_protective_stop_keeps_all_power(robot: RobotDescription) -> None:
    plan = StopPlan(robot)
    assert len(plan.unpowered_at_once(Reaction.HOLD)) == 0
    assert len(plan.unpowered_at_rest(Reaction.HOLD)) == 0
    assert plan.base_category(Reaction.HOLD) is StopCategory.STOP_KEEP_POWER


@pytest.mark.parametrize("category", StopCategory)
def test_wheels_that_do_not_obey_lose_power_whatever_their_category(
    robot: RobotDescription, category: StopCategory
) -> None:
    base = {
        name: replace(group, stop_category=category)
        for name, group in robot.groups.items()
        if robot.can_bus.drives[0].joint in group.joints
    }
    plan = StopPlan(replace(robot, groups={**robot.groups, **base}))
    assert plan.base_category(Reaction.BASE_OFF) is not StopCategory.STOP_KEEP_POWER
    assert len(plan.unpowered_at_once(Reaction.BASE_OFF)) == 0
    assert len(plan.unpowered_at_rest(Reaction.BASE_OFF)) == 0


def test_a_servo_gives_its_stall_torque_at_its_full_duty_error(robot: RobotDescription) -> None:
    by_joint = dict(zip(robot.joint_names, stiffness(robot), strict=True))
    assert by_joint["left_shoulder_yaw"] == pytest.approx(10.6 / 0.1086, rel=1e-3)
    assert by_joint["left_gripper"] == pytest.approx(1.6 / 0.1086 / 0.012**2, rel=1e-3)


def test_the_offset_makes_the_holding_torque(robot: RobotDescription) -> None:
    model = RobotModel(robot)
    pose = np.clip(0.4, robot.position_min, robot.position_max)
    offset = GravityOffset(robot, model.gravity).at(pose)
    assert offset * stiffness(robot) == pytest.approx(model.gravity(pose), abs=1e-9)
    assert np.abs(offset).max() > 0.01


def test_the_offset_is_bounded_whatever_the_model_says(robot: RobotDescription) -> None:
    heavy = GravityOffset(robot, lambda q: np.full(len(q), 1e6))
    offset = dict(zip(robot.joint_names, heavy.at(np.zeros(16)), strict=True))
    assert offset["left_elbow"] == pytest.approx(0.2)
    assert offset["left_gripper"] == pytest.approx(0.2 * 0.012)


def with_arm(
    robot: RobotDescription, category: StopCategory, drop_payload: bool = False
) -> RobotDescription:
    names = ("left_arm", "left_gripper")
    changed = {
        name: replace(robot.groups[name], stop_category=category, drop_payload=drop_payload)
        for name in names
    }
    return replace(robot, groups={**robot.groups, **changed})


def left_side(robot: RobotDescription) -> set[str]:
    return {*robot.groups["left_arm"].joints, *robot.groups["left_gripper"].joints}


@pytest.mark.parametrize("category", [StopCategory.POWER_REMOVED, StopCategory(1)])
def test_an_arm_that_holds_something_keeps_its_power(
    robot: RobotDescription, category: StopCategory
) -> None:
    changed = with_arm(robot, category)
    plan = StopPlan(changed)
    assert names(changed, plan.unpowered_at_rest(Reaction.GROUP_STOP)) == left_side(changed)
    assert names(changed, plan.unpowered_at_rest(Reaction.GROUP_STOP, {"right"})) == left_side(
        changed
    )
    assert len(plan.unpowered_at_once(Reaction.GROUP_STOP, {"left"})) == 0
    assert len(plan.unpowered_at_rest(Reaction.GROUP_STOP, {"left"})) == 0
    assert len(plan.released({"left"})) == 0


def test_a_robot_that_is_switched_off_keeps_only_what_would_drop_something(
    robot: RobotDescription,
) -> None:
    plan = StopPlan(robot)
    every = set(robot.joint_names)
    assert names(robot, plan.switched_off(())) == every
    assert names(robot, plan.switched_off({"left"})) == every - left_side(robot)


def test_an_arm_that_may_drop_its_payload_loses_power_all_the_same(robot: RobotDescription) -> None:
    changed = with_arm(robot, StopCategory.POWER_REMOVED, drop_payload=True)
    plan = StopPlan(changed)
    assert len(plan.switched_off({"left"})) == len(robot.joint_names)
    assert names(changed, plan.unpowered_at_once(Reaction.GROUP_STOP, {"left"})) == left_side(
        changed
    )


def test_a_pause_takes_no_power_from_anything(robot: RobotDescription) -> None:
    plan = StopPlan(with_arm(robot, StopCategory.POWER_REMOVED))
    assert len(plan.unpowered_at_once(Reaction.PROTECTIVE_STOP)) == 0
    assert plan.base_category(Reaction.PROTECTIVE_STOP) is StopCategory.STOP_KEEP_POWER
