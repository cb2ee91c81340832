"""Work out what to calibrate from the command line and the robot file, before a bus is touched."""

import argparse
from collections.abc import Mapping, Sequence

from drivers.dynamixel.servo import ServoSpec
from drivers.dynamixel.tools.travel import JointRange, ServoMounting
from vla_deploy.cli.calibration_guide import GuidedJoint
from vla_deploy.cli.errors import UsageError
from vla_deploy.robots import RobotDescription
from vla_deploy.robots.kinematics.mjcf import read_mjcf_names


def read_pose(robot: RobotDescription, text: str) -> dict[str, float]:
    """Return the joints' values of a pose of the robot, or of `joint=value,...`.

    Raises:
        UsageError: it is neither.
    """
    if text in robot.poses:
        return dict(robot.poses[text])
    values = {}
    for part in text.split(","):
        joint, equals, value = part.partition("=")
        try:
            values[joint.strip()] = float(value)
        except ValueError:
            known = ", ".join(robot.poses)
            expected = f"expected joint=value,... or a pose of the robot: {known}"
            raise UsageError(f"--from-pose {text}: {expected}") from None
        if not equals:
            raise UsageError(f"--from-pose {text}: expected joint=value, got {part!r}")
    return values


def chosen_joints(robot: RobotDescription, names: Sequence[str]) -> list[str]:
    """Return the named joints, all of them when none is named.

    Raises:
        UsageError: the robot has no such joint.
    """
    unknown = [name for name in names if name not in robot.joint_index]
    if unknown:
        known = ", ".join(robot.joint_names)
        raise UsageError(f"{robot.name} has no servo joint {', '.join(unknown)}; it has {known}")
    return list(names) or list(robot.joint_names)


def require_values(
    robot: RobotDescription,
    names: Sequence[str],
    pose: Mapping[str, float],
    arguments: argparse.Namespace,
) -> None:
    """Refuse a value that the joint cannot have.

    Raises:
        UsageError: a value is missing or outside of the joint's range.
    """
    is_mark = not pose and arguments.method == "mark"
    values = dict.fromkeys(names, arguments.at) if is_mark else pose
    ranges = read_mjcf_names(robot.mjcf_path).joint_ranges
    missing = [name for name in names if pose and name not in pose]
    if missing:
        raise UsageError(f"--from-pose gives no value for {', '.join(missing)}")
    for name, value in values.items():
        low, high = ranges[name] or (robot.limits[name].min, robot.limits[name].max)
        if not low <= value <= high:
            raise UsageError(f"{name}: {value:g} is outside of its range {low:g}..{high:g}")


def guided_joints(robot: RobotDescription, names: Sequence[str]) -> list[GuidedJoint]:
    """Return what robot file and MJCF know of the joints."""
    ranges = read_mjcf_names(robot.mjcf_path).joint_ranges
    joints = []
    for name in names:
        servo = robot.servo_bus.servos[robot.joint_index[name]]
        limits = robot.limits[name]
        low, high = ranges[name] or (limits.min, limits.max)
        joints.append(
            GuidedJoint(
                servo=ServoSpec(id=servo.id, model_name=servo.model, joint=name),
                range=JointRange(
                    joint=name,
                    low=low,
                    high=high,
                    sign=servo.sign,
                    travel_per_rad=servo.travel_per_rad,
                ),
                limits=limits,
                present=ServoMounting(sign=servo.sign, offset=servo.offset),
            )
        )
    return joints
