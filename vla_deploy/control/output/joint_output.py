"""Move the joints: from the motions through the gate to the servos, on the only way there is."""

from typing import Final

import numpy as np

from drivers.servo.state import SILENT_S
from vla_deploy.control.judging.thresholds import contact_torque
from vla_deploy.control.motion.axes import Flags, Floats, any_of
from vla_deploy.control.motion.motions import MotionResult, MotionSet
from vla_deploy.control.output.gravity import GravityOffset, full_duty_error
from vla_deploy.control.output.limits import SetpointGate
from vla_deploy.control.output.payload import Payload
from vla_deploy.control.output.servos import ServoLine
from vla_deploy.robots import RobotDescription
from vla_deploy.robots.kinematics.model import RobotModel

# Of the torque that counts as contact: what a stopped joint may go on pressing with.
EASED_RATIO: Final = 0.5
# Of the joint's top speed: slower than what counts as motion while the robot has to stand.
EASING_RATIO: Final = 0.05
UNWINDING_RATIO: Final = 0.3
HELD_TICKS: Final = 3
"""So long a joint may be unheard before its goal stands: it may hear what it does not answer."""


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
        self._eased_nm = EASED_RATIO * contact_torque(robot)
        self._easing_rad_s = EASING_RATIO * robot.velocity_max
        self._unwinding_rad_s = UNWINDING_RATIO * robot.velocity_max
        self._arms = [
            np.array([robot.joint_index[name] for name in robot.group(hand.arm).joints])
            for hand in robot.hands.values()
        ]
        self._full_error = full_duty_error(robot)
        self._silent = np.zeros(len(robot.joint_names), dtype=np.bool_)
        self._answered_to = np.full(len(robot.joint_names), np.nan)

    @property
    def sent(self) -> Floats:
        """Return the setpoints that were sent last, without what carries the weight."""
        return self._gate.sent

    @property
    def weight_offset(self) -> Floats:
        """Return how far above its setpoint each goal is, so that the motor carries the weight."""
        return self._gravity.at(self.sent)

    def move(self, period_s: float) -> list[MotionResult]:
        """Advance the setpoints, bound them, add what gravity asks for, and send them."""
        state = self._servos.state
        loose = ~state.torque_on | (state.watchdog < 0)
        if any_of(loose):
            self.place(loose)
        ended = self._take_back(period_s)
        ended += self.motions.advance(period_s)
        setpoint, unheard = self.motions.state.position, state.age_s > HELD_TICKS * period_s
        if any_of(unheard):
            setpoint = np.where(unheard, self.sent, setpoint)
        sent = self._gate.limit(setpoint, period_s)
        if any_of(state.torque_on):
            self._servos.write(sent + self._gravity.at(sent))
        return ended

    def _take_back(self, period_s: float) -> list[MotionResult]:
        """Let joints that were silent, and have missed their goals, begin where they are.

        What they were to do meanwhile is over, and with it every motion. One whose setpoint stood
        has missed none: begun anew at every answer of a loose plug, it would sag a bit each time.
        """
        age_s = self._servos.state.age_s
        silent = age_s > SILENT_S
        back: Flags = self._silent & ~silent
        if any_of(back):
            back &= self.motions.state.position != self._answered_to
        self._silent = silent
        np.copyto(self._answered_to, self.motions.state.position, where=age_s < period_s)
        if not any_of(back):
            return []
        self.place(back)
        return self.motions.stop("joints answer again after a silence")

    def place(self, joints: Flags) -> None:
        """Let setpoints of joints that take no goals follow them, so that arming is bumpless.

        A hand whose servo still presses on what it holds goes on pressing.
        """
        state = self._servos.state
        begin = state.position_rad
        if any_of(joints & state.torque_on):
            pressed = self._payload.pressed(begin, state.effort_ratio)
            begin = np.where(state.torque_on, pressed, begin)
        self.motions.place(begin, joints)
        self._gate.place(begin, joints)

    def ease_off(self, external_torque_nm: Floats, period_s: float) -> None:
        """Take back, slowly, setpoints by which joints at rest press hard on what they have met.

        A setpoint goes no further than to where its joint is, and only while the torque that is
        felt agrees that it presses that way; what carries the arm's own weight is added later.
        An arm with a limp joint stays where it is: what falls or hangs there feels like a contact.
        """
        error = self.sent - self._servos.state.position_rad
        presses = (np.abs(external_torque_nm) > self._eased_nm) & (error * external_torque_nm < 0.0)
        for arm in self._arms:
            presses[arm] &= self._servos.state.torque_on[arm].all()
        if any_of(presses):
            # Further ahead than the motor can follow it presses no less: that part goes quickly.
            winds = np.abs(error + self.weight_offset) > self._full_error
            step = np.where(winds, self._unwinding_rad_s, self._easing_rad_s) * period_s
            self.lead(self.sent - np.minimum(np.maximum(error, -step), step), presses)

    def place_all(self) -> None:
        """Let every setpoint begin where its joint is."""
        self.place(np.ones(len(self.sent), dtype=np.bool_))

    def lead(self, setpoint: Floats, joints: Flags) -> None:
        """Choose the next setpoints of these joints, without a motion; the gate bounds them."""
        self.motions.place(setpoint, joints)
