"""Turn the pulses of a leader's servos into joint values of the robot that follows it.

Both arms are calibrated as LeRobot does it: a joint is as far from the middle of its range as the
leader's is, a gripper is open by the same share of its range.
"""

from collections.abc import Mapping
from typing import Final

import numpy as np

from drivers.servo.joint_servo import JointServo
from drivers.servo.tools.bench import ServoBench
from drivers.servo.tools.travel import PULSES_PER_REV
from vla_deploy.robots import RobotDescription
from vla_deploy.robots.calibration.lerobot_conversion import SHOWN_BY_OFFSET
from vla_deploy.robots.calibration.lerobot_file import LeRobotMotor
from vla_deploy.robots.calibration.lerobot_units import DEGREES_PER_PULSE, units_of
from vla_deploy.teleoperation.errors import LeaderUnusable
from vla_deploy.teleoperation.hand_pose import Floats

HOMING_REGISTER: Final = "homing_offset"
_PER_CENT: Final = 100.0
_DRIVE_MODE_COUNTS: Final = "feetech"  # a Dynamixel turns its count by itself


class LeaderScale:
    """Convert the pulses of some joints, in the order of `joints`."""

    def __init__(
        self,
        robot: RobotDescription,
        motors: Mapping[str, LeRobotMotor],
        held_offsets: Mapping[str, int],
        family: str,
    ) -> None:
        """Take the leader's calibration, and the homing offsets that its servos hold.

        Raises:
            LeaderUnusable: the calibration names a joint that the robot has not.
            RobotFileError: the robot's own calibration cannot be used.
        """
        strange = [name for name in motors if name not in robot.joint_index]
        if strange:
            raise LeaderUnusable(
                f"the leader's calibration has {', '.join(strange)}; {robot.name} has "
                f"{', '.join(robot.joint_names)}: give the leader's joints the robot's names"
            )
        self.joints = tuple(name for name in robot.joint_names if name in motors)
        chosen = [motors[name] for name in self.joints]
        shown = SHOWN_BY_OFFSET[family]
        self._shift = np.array(
            [shown * (motors[one].homing_offset - held_offsets[one]) for one in self.joints]
        )
        low = np.array([motor.range_min for motor in chosen], dtype=np.float64)
        high = np.array([motor.range_max for motor in chosen], dtype=np.float64)
        is_turned = np.array([m.drive_mode == 1 and family == _DRIVE_MODE_COUNTS for m in chosen])
        self._is_gripper = np.array([one in robot.gripper_joints for one in self.joints])
        self._middle = (low + high) / 2
        self._scale = np.where(
            self._is_gripper,
            np.where(is_turned, -_PER_CENT, _PER_CENT) / (high - low),
            DEGREES_PER_PULSE,
        )
        self._rows = [robot.joint_index[one] for one in self.joints]
        self._units = units_of(robot)
        self._all = np.zeros(len(robot.joint_names))

    def to_joints(self, pulses: Floats) -> Floats:
        """Return the values of `joints`: of the turn of each servo, that around its middle."""
        half_turn = PULSES_PER_REV / 2
        off_middle = pulses + self._shift - self._middle
        off_middle = (off_middle + half_turn) % PULSES_PER_REV - half_turn
        values = off_middle * self._scale
        half = _PER_CENT / 2
        values = np.where(self._is_gripper, np.clip(values, -half, half) + half, values)
        self._all[self._rows] = values
        joints: Floats = self._units.to_joints(self._all)[self._rows]
        return joints


def held_offset(bench: ServoBench, servo: JointServo) -> int:
    """Return the homing offset that a servo holds; models without one hold none.

    Raises:
        DriverError: it is silent.
    """
    found = [one.value for one in bench.registers(servo) if one.name == HOMING_REGISTER]
    return found[0] if found else 0
