"""Read a leader arm that has a robot file of its own: its joints, signs and calibration are there.

A joint is as far from the middle of its travel as the leader's is from its own, a gripper is open
by the same share as the leader's trigger: as between two arms that LeRobot has calibrated.
"""

from collections.abc import Sequence
from typing import Final

import numpy as np

from drivers.clock import Clock
from drivers.servo.joint_servo import JointServo
from drivers.servo.tools.bench import ServoBench
from drivers.servo.tools.scan import is_model
from vla_deploy.robots import RobotDescription
from vla_deploy.robots.joint_calibration import guided_joints
from vla_deploy.robots.servos.declared import servo_specs
from vla_deploy.teleoperation.errors import LeaderUnusable
from vla_deploy.teleoperation.hand_pose import Floats
from vla_deploy.teleoperation.leader_arm import LeaderArm, require_free

_TURN_RAD: Final = 2 * np.pi


class LeaderRobotScale:
    """Convert the pulses of a leader's servos into joint values of the robot that follows it."""

    def __init__(
        self, leader: RobotDescription, follower: RobotDescription, servos: Sequence[JointServo]
    ) -> None:
        """Take the servos in the order of the leader's joints."""
        self.joints = leader.joint_names
        ranges = [joint.range for joint in guided_joints(follower, self.joints)]
        limits = [follower.limits[name] for name in self.joints]
        self._servos = servos
        self._low, self._high = leader.position_min, leader.position_max
        self._turn = _TURN_RAD * np.array([servo.travel_per_rad for servo in servos])
        self._middle = np.array([one.middle for one in ranges])
        self._is_gripper = np.array([name in follower.gripper_joints for name in self.joints])
        self._closed = np.array([one.min for one in limits])
        self._opens = np.array([one.max - one.min for one in limits])

    def to_joints(self, pulses: Floats) -> Floats:
        """Return the values of `joints`: of the turn of each servo, that around its middle."""
        values = np.array(
            [servo.to_joint(one) for servo, one in zip(self._servos, pulses, strict=True)]
        )
        off_middle = values - (self._low + self._high) / 2
        off_middle = (off_middle + self._turn / 2) % self._turn - self._turn / 2
        share = np.clip(off_middle / (self._high - self._low) + 0.5, 0.0, 1.0)
        joints: Floats = np.where(
            self._is_gripper, self._closed + share * self._opens, self._middle + off_middle
        )
        return joints


def open_leader_robot(
    bench: ServoBench, clock: Clock, follower: RobotDescription, leader: RobotDescription
) -> LeaderArm:
    """Check that a leader is as its file says and has no torque; nothing is written.

    Raises:
        LeaderUnusable: a servo has torque or is of another model, or the follower lacks a joint.
        DriverError: a servo is silent.
    """
    strange = [name for name in leader.joint_names if name not in follower.joint_index]
    if strange:
        raise LeaderUnusable(
            f"{leader.name} has {', '.join(strange)}; {follower.name} has "
            f"{', '.join(follower.joint_names)}: a leader's joints have the names of the follower's"
        )
    servos = servo_specs(leader)
    for servo in servos:
        found = bench.ping(servo.id).model_name
        if not is_model(found, servo.model_name):
            raise LeaderUnusable(f"{servo}: it is {found}; see: vla-deploy servo scan")
    require_free(bench, {servo.joint: servo for servo in servos})
    return LeaderArm(bench, clock, servos, LeaderRobotScale(leader, follower, servos))
