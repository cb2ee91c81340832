"""Let arms come down before their power goes: the motors brake what falls, and never push."""

from typing import Final

import numpy as np

from vla_deploy.control.motion.axes import Axes, Floats, any_of
from vla_deploy.control.output.gravity import full_duty_error
from vla_deploy.control.output.joint_output import JointOutput
from vla_deploy.control.output.servos import ServoLine
from vla_deploy.robots import RobotDescription

LOWERING_S: Final = 8.0
"""After this, power goes wherever the arms are; from over a table the way down takes five."""

# Of a joint's top speed: slow enough to step aside, and to knock nothing over.
_RATE_RATIO: Final = 0.3
# A joint that needs the second share of full duty to be held comes down at that rate, one that
# hangs lighter more slowly, and one below the first not at all: gears hold that much by themselves.
_PULL_RATIOS: Final = (0.02, 0.06)
# Of the weight: what a motor leaves to gravity at most. It never presses on what the arm meets.
_GIVEN_RATIO: Final = 0.9
_STANDS_RAD: Final = 0.02  # less than this, within that time, is no way down
_STANDS_FOR_S: Final = 0.6


class Lowering:
    """Bring those of some joints down that have power, each by its own weight."""

    def __init__(
        self, robot: RobotDescription, output: JointOutput, servos: ServoLine, joints: Axes
    ) -> None:
        travel = np.array([servo.travel_per_rad for servo in robot.servo_bus.servos])
        self._least_offset, self._full_offset = np.outer(_PULL_RATIOS, full_duty_error(robot))
        self._stands_within = _STANDS_RAD * np.abs(travel)
        self._rate = _RATE_RATIO * robot.velocity_max
        self._output = output
        self._servos = servos
        self._joints = np.zeros(len(travel), dtype=np.bool_)
        self._joints[joints] = True
        self._stood_at = servos.state.position_rad.copy()
        self._stood_s = 0.0

    def step(self, period_s: float) -> bool:
        """Choose the next tick's setpoints; tell whether nothing comes down any more."""
        state = self._servos.state
        joints = self._joints & state.torque_on & (state.watchdog >= 0)
        if self._servos.lost or not any_of(joints):
            return True
        setpoint = self._next(state.position_rad, self._output.weight_offset, period_s)
        self._output.lead(setpoint, joints)
        self._stood_s += period_s
        if any_of(joints & (np.abs(state.position_rad - self._stood_at) > self._stands_within)):
            self._stood_at, self._stood_s = state.position_rad.copy(), 0.0
        return self._stood_s >= _STANDS_FOR_S

    def _next(self, position: Floats, offset: Floats, period_s: float) -> Floats:
        """Return setpoints that follow the weight.

        A setpoint leads its joint by no more than a share of what carries the weight: a joint that
        has met something, or lags, still feels its motor against the weight. What has no weight to
        follow eases off what it may press on.
        """
        span = self._full_offset - self._least_offset
        pull = np.clip((np.abs(offset) - self._least_offset) / span, 0.0, 1.0)
        step, sent = self._rate * period_s, self._output.sent
        wanted = sent - np.sign(offset) * pull * step
        furthest = position - _GIVEN_RATIO * offset
        down = np.where(offset > 0.0, np.maximum(wanted, furthest), wanted)
        followed = np.where(offset < 0.0, np.minimum(wanted, furthest), down)
        eased = sent - np.clip(sent - position, -step, step)
        setpoint: Floats = np.where(pull > 0.0, followed, eased)
        return setpoint
