"""Turn the run's times and angles into fields of messages, and back.

On a robot ROS time is the computer's wall clock; on the twin it is the twin's time, which goes out
on /clock. Where the wall clock is set meanwhile, later stamps follow it.
"""

import math
import time
from typing import Final

from builtin_interfaces.msg import Time
from geometry_msgs.msg import Pose, Quaternion

from drivers.clock import NS_PER_S, Clock
from drivers.twin_clock import TwinClock
from vla_deploy.robots.floor_pose import Pose2D


class RosTime:
    """Convert times of one run's clock."""

    def __init__(self, clock: Clock) -> None:
        self.clock: Final = clock
        self.is_simulated: Final = isinstance(clock, TwinClock)
        self._offset_ns = 0
        self.refresh()

    def refresh(self) -> None:
        """Follow the wall clock."""
        if not self.is_simulated:
            self._offset_ns = time.time_ns() - self.clock.now_ns()

    def stamp(self, run_ns: int) -> Time:
        """Return a moment of the run as a message's stamp."""
        seconds, nanoseconds = divmod(max(run_ns + self._offset_ns, 0), NS_PER_S)
        return Time(sec=seconds, nanosec=nanoseconds)

    def now(self) -> Time:
        """Return the present as a message's stamp."""
        return self.stamp(self.clock.now_ns())

    def now_ns(self) -> int:
        """Return the present in nanoseconds of ROS time."""
        return self.clock.now_ns() + self._offset_ns

    def run_ns(self, stamp: Time) -> int:
        """Return a message's stamp as a moment of the run."""
        return int(stamp.sec) * NS_PER_S + int(stamp.nanosec) - self._offset_ns

    def is_unset(self, stamp: Time) -> bool:
        """Return whether a sender has left the stamp out."""
        return not (stamp.sec or stamp.nanosec)


def quaternion_of(yaw_rad: float, pitch_rad: float = 0.0, roll_rad: float = 0.0) -> Quaternion:
    """Return a rotation by yaw, then pitch, then roll, each about the axis as turned so far."""
    cr, sr = math.cos(roll_rad / 2), math.sin(roll_rad / 2)
    cp, sp = math.cos(pitch_rad / 2), math.sin(pitch_rad / 2)
    cy, sy = math.cos(yaw_rad / 2), math.sin(yaw_rad / 2)
    return Quaternion(
        w=cr * cp * cy + sr * sp * sy,
        x=sr * cp * cy - cr * sp * sy,
        y=cr * sp * cy + sr * cp * sy,
        z=cr * cp * sy - sr * sp * cy,
    )


def fill_pose(message: Pose, pose: Pose2D, z_m: float = 0.0) -> None:
    """Fill in a pose that is turned about the vertical axis only."""
    position = message.position
    position.x, position.y, position.z = pose.x_m, pose.y_m, z_m
    message.orientation = quaternion_of(pose.yaw_rad)


def yaw_of(rotation: Quaternion) -> float:
    """Return a rotation's angle about the vertical axis, in rad."""
    siny = 2.0 * (rotation.w * rotation.z + rotation.x * rotation.y)
    cosy = 1.0 - 2.0 * (rotation.y * rotation.y + rotation.z * rotation.z)
    return math.atan2(siny, cosy)
