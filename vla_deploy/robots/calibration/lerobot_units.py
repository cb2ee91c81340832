"""Convert joint values to the numbers that LeRobot's datasets and policies hold, and back.

Formulas of huggingface/lerobot v0.6.2, motors/motors_bus.py `_normalize`, `_unnormalize`, but
without the rounding to whole pulses.
"""

from collections.abc import Mapping
from enum import Enum
from typing import Final

import numpy as np
from numpy.typing import NDArray

from drivers.servo.family import family_of
from drivers.servo.tools.travel import CENTRE_PULSE, PULSE_RAD
from vla_deploy.robots.calibration.calibration import (
    CALIBRATION_FILE,
    JointCalibration,
    read_calibration,
)
from vla_deploy.robots.calibration.lerobot_conversion import swept_joints
from vla_deploy.robots.calibration.lerobot_file import TOP_PULSE
from vla_deploy.robots.description import RobotDescription

Floats = NDArray[np.float64]
DEGREES_PER_PULSE: Final = 360.0 / TOP_PULSE
"""LeRobot divides by the last pulse, not by the pulses of a turn: one reads 360.09 degrees."""
FEATURE_SUFFIX: Final = ".pos"
_PER_CENT: Final = 100.0
_DRIVE_MODE_COUNTS: Final = ("feetech",)  # LeRobot's Dynamixel bus does not apply it


class LeRobotUnit(Enum):
    """Name the unit of joints that are no gripper; a gripper is 0 (closed) to 100 in both."""

    DEGREES = "degrees"
    """From the middle of the range; the default of LeRobot's arms since v0.4.4."""
    RANGE = "range"
    """-100 to 100 of the range."""


class LeRobotUnits:
    """Convert arrays of joint values, in the robot's order, for one calibration and one unit."""

    def __init__(
        self,
        robot: RobotDescription,
        calibrations: Mapping[str, JointCalibration],
        unit: LeRobotUnit = LeRobotUnit.DEGREES,
    ) -> None:
        servos = robot.servo_bus.servos
        swept = swept_joints(robot, calibrations)
        motors = [swept[servo.joint].motor for servo in servos]
        low = np.array([motor.range_min for motor in motors], dtype=np.float64)
        high = np.array([motor.range_max for motor in motors], dtype=np.float64)
        shift = np.array([swept[servo.joint].shift for servo in servos], dtype=np.float64)
        is_gripper = np.array([servo.joint in robot.gripper_joints for servo in servos])
        is_turned = np.array(
            [
                motor.drive_mode == 1 and family_of(servo.model).name in _DRIVE_MODE_COUNTS
                for motor, servo in zip(motors, servos, strict=True)
            ]
        )
        by_range = is_gripper | (unit is LeRobotUnit.RANGE)
        half_range = np.where(is_gripper, _PER_CENT / 2, _PER_CENT)
        scale = np.where(by_range, 2.0 * half_range / (high - low), DEGREES_PER_PULSE)
        self.feature_names = tuple(servo.joint + FEATURE_SUFFIX for servo in servos)
        self._offset = np.array([servo.offset for servo in servos])
        self._per_pulse = np.array(
            [servo.sign * servo.travel_per_rad * PULSE_RAD for servo in servos]
        )
        self._middle = (low + high) / 2 + shift
        self._scale = np.where(by_range & is_turned, -scale, scale)
        self._centre = np.where(is_gripper, _PER_CENT / 2, 0.0)
        self._bound = np.where(by_range, half_range, np.inf)

    def to_lerobot(self, positions: Floats) -> Floats:
        """Return joint values (rad, or m) as LeRobot reads them: clipped where it clips."""
        pulses = CENTRE_PULSE + (positions - self._offset) / self._per_pulse
        values = (pulses - self._middle) * self._scale
        clipped: Floats = np.clip(values, -self._bound, self._bound)
        return clipped + self._centre

    def to_joints(self, values: Floats) -> Floats:
        """Return LeRobot's numbers as joint values; what is beyond a range stays beyond it."""
        pulses = self._middle + (values - self._centre) / self._scale
        return self._offset + self._per_pulse * (pulses - CENTRE_PULSE)


def units_of(robot: RobotDescription, unit: LeRobotUnit = LeRobotUnit.DEGREES) -> LeRobotUnits:
    """Return the units by the calibration in a robot's folder.

    Raises:
        RobotFileError: that file cannot be used.
    """
    file = robot.folder / CALIBRATION_FILE
    return LeRobotUnits(robot, read_calibration(file), unit)
