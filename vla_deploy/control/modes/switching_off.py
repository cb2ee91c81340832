"""Take a robot out of power: what holds something keeps it, and arms come down first."""

import logging

import numpy as np

from vla_deploy.control.modes.controlled_descent import Lowering
from vla_deploy.control.modes.stopping import Stopping
from vla_deploy.control.motion.axes import Axes
from vla_deploy.control.output.joint_output import JointOutput
from vla_deploy.control.output.servos import ServoLine
from vla_deploy.robots import RobotDescription

_LOG = logging.getLogger(__name__)


class SwitchingOff:
    """Bring down the arms that lose their power, and take it.

    An emergency stop on the way leaves them standing where they are, under power: what nobody saw
    coming down is worse than what stays up. One that was asked for before forbids nothing: to
    switch off is the later wish.
    """

    def __init__(
        self, robot: RobotDescription, servos: ServoLine, stopping: Stopping, output: JointOutput
    ) -> None:
        self._names = robot.joint_names
        self._servos = servos
        self._stopping = stopping
        servos.try_reopen()
        self._joints = self._taken_over(stopping.switching_off())
        self._lowering = Lowering(robot, output, servos, self._joints)
        self._stopped_by = ""

    def step(self, period_s: float, estop_source: str | None) -> bool:
        """Choose the next tick's setpoints; tell whether power may go, or has to stay."""
        self._stopped_by = estop_source or ""
        return bool(estop_source) or self._lowering.step(period_s)

    def end(self) -> None:
        """Take the power, and log what keeps it."""
        if self._stopped_by:
            _LOG.error("arms keep their power: emergency stop (%s) as they came down; support "
                       "them, then switch off the servos' supply", self._stopped_by)  # fmt: skip
            return
        failure = self._stopping.switch_off(self._joints)
        if failure:
            _LOG.error("servos may have kept their power: %s; support the arms, then switch off "
                       "their supply", failure)  # fmt: skip

    def _taken_over(self, joints: Axes) -> Axes:
        """Return those joints that can come down or hold nothing up.

        Servos that their Bus Watchdog has stopped hold by themselves and take no goals, until they
        are taken over; one that cannot be is left as it is, for its arm would fall.
        """
        tripped = self._servos.watchdog_tripped & self._servos.state.torque_on
        if not tripped.any():
            return joints
        cleared = self._servos.clear_watchdogs()
        lost = [
            n for n in np.flatnonzero(tripped) if not (cleared and self._servos.energise(int(n)))
        ]
        if lost:
            held = ", ".join(self._names[n] for n in lost)
            _LOG.error("%s keep their power: %s; support them, then switch off the servos' supply",
                       held, self._servos.failure)  # fmt: skip
        return np.setdiff1d(joints, lost)
