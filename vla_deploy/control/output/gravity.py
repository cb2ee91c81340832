"""Offset goals so that position servos without an integral part carry the arm's own weight.

Such a servo turns position error into duty, so at rest it sags until the error makes the holding
torque. Asking for q + g(q) / kp makes it rest on q. This is done here and nowhere else.
"""

from collections.abc import Callable

import numpy as np

from drivers.servo.family import family_of
from vla_deploy.control.motion.axes import Floats
from vla_deploy.robots import RobotDescription

_MAX_OFFSET_RAD = 0.2


def stiffness(robot: RobotDescription) -> Floats:
    """Return each joint's holding torque per unit of position error (N m/rad, or N/m)."""
    stall = [robot.stall_effort(servo.joint) for servo in robot.servo_bus.servos]
    return np.array(stall) / full_duty_error(robot)


def full_duty_error(robot: RobotDescription) -> Floats:
    """Return the error at which each joint's motor gives all it has (rad, or m of a finger)."""
    return np.array(
        [
            family_of(servo.model).facts(servo.model).full_duty_error_rad
            * abs(servo.travel_per_rad)
            for servo in robot.servo_bus.servos
        ]
    )


class GravityOffset:
    """Compute how far above its setpoint each joint's goal must be."""

    def __init__(self, robot: RobotDescription, gravity: Callable[[Floats], Floats]) -> None:
        """Take the function that returns every servo joint's gravity torque at a pose."""
        self._gravity = gravity
        self._compliance = 1.0 / stiffness(robot)
        travel = np.array([servo.travel_per_rad for servo in robot.servo_bus.servos])
        self._limit = _MAX_OFFSET_RAD * travel
        self._pose = b""
        self._offset: Floats = np.zeros_like(self._limit)

    def at(self, position: Floats) -> Floats:
        """Return the offsets for the setpoints `position`, which often are the last tick's."""
        pose = position.tobytes()
        if pose != self._pose:
            offset = self._gravity(position) * self._compliance
            self._offset = np.minimum(np.maximum(offset, -self._limit), self._limit)
            self._pose = pose
        return self._offset
