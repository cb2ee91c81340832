"""Move the joints: from the motions through the gate to the servos, on the only way there is."""

from typing import Final

import numpy as np

from vla_deploy.control.axes import Flags, Floats, any_of
from vla_deploy.control.gravity import GravityOffset, stiffness
from vla_deploy.control.limits import SetpointGate
from vla_deploy.control.motions import MotionResult, MotionSet
from vla_deploy.control.payload import Payload
from vla_deploy.control.servos import ServoLine
from vla_deploy.control.thresholds import contact_torque
from vla_deploy.robots import RobotDescription
from vla_deploy.robots.model import RobotModel

# Of the torque that counts as contact: what a stopped joint may go on pressing with.
EASED_RATIO: Final = 0.5


class JointOutput:
    """Hold the motions of all joints, and send what the gate lets through."""

    def __init__(
        self, robot: RobotDescription, motions: MotionSet, servos: ServoLine, payload: Payload
    ) -> None:
        self.motions = motions
        self._servos = servos
        self._payload = payload
        self._gate = SetpointGate(robot.position_min, robot.position_max, robot.velocity_max)
        self._gravity = GravityOffset(robot, RobotModel(robot).gravity)
        self._eased = EASED_RATIO * contact_torque(robot) / stiffness(robot)

    @property
    def sent(self) -> Floats:
        """Return the setpoints that were sent last, without what carries the weight."""
        return self._gate.sent

    def move(self, period_s: float) -> list[MotionResult]:
        """Advance the setpoints, bound them, add what gravity asks for, and send them."""
        state = self._servos.state
        loose = ~state.torque_on | (state.watchdog < 0)
        if any_of(loose):
            self.place(loose)
        ended = self.motions.advance(period_s)
        sent = self._gate.limit(self.motions.state.position, period_s)
        if any_of(state.torque_on):
            self._servos.write(sent + self._gravity.at(sent))
        return ended

    def place(self, joints: Flags) -> None:
        """Let setpoints of joints that take no goals follow them, so that arming is bumpless.

        A hand whose servo still presses on what it holds goes on pressing.
        """
        state = self._servos.state
        begin = state.position_rad
        if any_of(joints & state.torque_on):
            begin = np.where(state.torque_on, self._payload.pressed(begin), begin)
        self.motions.place(begin, joints)
        self._gate.place(begin, joints)

    def ease_off(self) -> None:
        """Let no joint press hard on what it has met: bring its setpoint near to where it is.

        What carries the arm's own weight is added later, and stays.
        """
        position = self._servos.state.position_rad
        eased = np.minimum(np.maximum(self.sent, position - self._eased), position + self._eased)
        pressing = np.isfinite(position) & (eased != self.sent)
        self.motions.place(eased, pressing)
        self._gate.place(eased, pressing)

    def place_all(self) -> None:
        """Let every setpoint begin where its joint is."""
        self.place(np.ones(len(self.sent), dtype=np.bool_))
