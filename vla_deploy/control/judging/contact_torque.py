"""Tell which torque at each joint neither the robot's motion nor its weight explains.

Measured motor current says what the joint gives, inverse dynamics what its motion takes; the
rest comes from outside: a payload, friction, or a contact. It passes a low-pass filter, for
accelerations are differences of coarsely measured velocities. Every tick counts: a servo that rings
from setpoint to setpoint gives a quarter of its stall torque to and fro, and single samples of that
now and then would show a torque that is not there.
"""

import numpy as np

from drivers.clock import NS_PER_S
from drivers.servo.family import family_of
from vla_deploy.control.motion.axes import Floats
from vla_deploy.robots import RobotDescription
from vla_deploy.robots.kinematics.model import RobotModel

FILTER_S = 0.06
# After a longer silence the filters begin anew.
_LONGEST_STEP_S = 0.1


class ContactTorque:
    """Filter the unexplained torque; joints whose servos do not measure current have none."""

    def __init__(self, robot: RobotDescription, model: RobotModel) -> None:
        self._model = model
        servos = robot.servo_bus.servos
        self.senses = np.array(
            [family_of(servo.model).facts(servo.model).senses_current for servo in servos],
            dtype=np.bool_,
        )
        # Torque in the joint's own unit: a pinion turns torque into force.
        self._stall = np.array([robot.stall_effort(servo.joint) for servo in servos])
        self._stamp_ns: int | None = None
        self._velocity: Floats = np.zeros(len(servos))
        self._torque: Floats = np.zeros(len(servos))
        self._noted: Floats = np.zeros((2, len(servos)))
        self._ticks = 0

    def note(self, velocity: Floats, effort_ratio: Floats) -> None:
        """Take in what the joints do in this tick."""
        self._noted[0] += velocity
        self._noted[1] += effort_ratio
        self._ticks += 1

    def update(self, now_ns: int, position: Floats) -> Floats | None:
        """Return the filtered torque in N m (N for a finger), in joint order.

        It is judged by the means of the ticks noted since the last time, at least one. None before
        there are two such times in a row with every value measured.
        """
        velocity, effort_ratio = self._noted / self._ticks
        self._noted.fill(0.0)
        self._ticks = 0
        step_s = 0.0 if self._stamp_ns is None else (now_ns - self._stamp_ns) / NS_PER_S
        self._stamp_ns = now_ns
        if not np.isfinite((position, velocity, effort_ratio)).all():
            self._stamp_ns = None
            return None
        if not 0.0 < step_s <= _LONGEST_STEP_S:
            self._velocity = velocity
            self._torque = np.zeros_like(velocity)
            return None
        share = step_s / (FILTER_S + step_s)
        acceleration = (velocity - self._velocity) / step_s
        self._velocity = velocity
        taken = self._model.inverse_dynamics(position, velocity, acceleration)
        excess = np.where(self.senses, taken - self._stall * effort_ratio, 0.0)
        self._torque = self._torque + share * (excess - self._torque)
        return self._torque
