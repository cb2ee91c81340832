"""Describe a robot's joints to the calibration guide, and store the mountings that it measures."""

from collections.abc import Mapping, Sequence
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from drivers.errors import NoReply
from drivers.servo.family import family_of
from drivers.servo.joint_servo import JointServo
from drivers.servo.tools.bench import ONE_TRY, ServoBench
from drivers.servo.tools.calibration_guide import GuidedJoint
from drivers.servo.tools.travel import JointRange, ServoMounting
from vla_deploy.robots.calibration.calibration import (
    JointCalibration,
    read_calibration,
    write_calibration,
)
from vla_deploy.robots.description import RobotDescription
from vla_deploy.robots.devices import shadow_name
from vla_deploy.robots.kinematics.mjcf import read_mjcf_names


def guided_joints(robot: RobotDescription, names: Sequence[str]) -> list[GuidedJoint]:
    """Describe joints by robot file and MJCF; a joint without a range there has its limits.

    So has one of a leader, whose MJCF may be that of the arm that follows it.
    """
    ranges = {} if robot.read_only else read_mjcf_names(robot.mjcf_path).joint_ranges
    joints = []
    for name in names:
        servo = robot.servo_bus.servos[robot.joint_index[name]]
        limits = (robot.limits[name].min, robot.limits[name].max)
        low, high = ranges.get(name) or limits
        joints.append(
            GuidedJoint(
                servo=family_of(servo.model).servo(
                    servo_id=servo.id,
                    model_name=servo.model,
                    joint=name,
                    sign=1,
                    offset_rad=0.0,
                    travel_per_rad=1.0,
                ),
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


def answering_servos(
    robot: RobotDescription, link: ServoBench, names: Sequence[str]
) -> list[JointServo]:
    """Return the robot's servos that answer; those of the named joints must.

    Raises:
        ServoSilent: the servo of a named joint does not answer.
    """
    answering = []
    for servo in robot.servo_bus.servos:
        try:
            if servo.joint not in names:
                link.ping(servo.id, ONE_TRY)
            answering.append(link.servo(servo.id, servo.joint))
        except NoReply:
            if servo.joint in names:
                raise
    return answering


def shadows_of(robot: RobotDescription, link: ServoBench, names: Sequence[str]) -> list[JointServo]:
    """Return the second servos of joints, which must let go, too, when these are moved by hand.

    Raises:
        ServoSilent: one does not answer.
    """
    return [
        link.servo(one.id, shadow_name(one.joint))
        for one in robot.servo_bus.shadows
        if one.joint in names
    ]


class CalibrationRecord:
    """Write measured mountings into a calibration file, over those of earlier sessions."""

    def __init__(self, file: Path) -> None:
        """Read the file.

        Raises:
            RobotFileError: it cannot be used.
        """
        self.file = file
        self.changes: list[dict[str, Any]] = []
        """A JSON row for each mounting of this session."""
        self._all = read_calibration(file)

    def store(
        self, joints: Sequence[GuidedJoint], found: Mapping[str, ServoMounting], method: str
    ) -> None:
        """Write the mountings of some joints, by joint name, at once.

        Raises:
            RobotFileError: the file cannot be written.
        """
        made_at = datetime.now(UTC).isoformat(timespec="seconds")
        for joint in joints:
            before, after = joint.present, found[joint.name]
            self._all[joint.name] = JointCalibration(
                servo_id=joint.servo.id,
                sign=after.sign,
                offset=round(after.offset, 6),
                method=method,
                made_at=made_at,
            )
            self.changes.append(
                {
                    "joint": joint.name,
                    "servo_id": joint.servo.id,
                    "sign_before": before.sign,
                    "sign": after.sign,
                    "offset_before": before.offset,
                    "offset": round(after.offset, 6),
                }
            )
        write_calibration(self.file, self._all)
