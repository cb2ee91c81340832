"""Turn goals into motor duty as FEETECH control loops do, for all servos of a bus at once.

Positions are steps, speeds steps per second, duties shares of full PWM. The registers' units come
from FEETECH's tables; how strong a gain is, no source says. Chosen: P = 32 puts full duty on an
error of 50 steps (owners measure 20 to 30 steps of error at half of the stall torque), D damps with
10 ms of P's strength, I reaches P's in a second; velocity P and I are such that the factory's reach
a speed within 0.2 s.

A damped motor (torque_enable = 2) and a free one do the same here: at zero duty a motor brakes.
"""

from typing import Final

import numpy as np
from numpy.typing import NDArray

from drivers.feetech.table import (
    ACCELERATION_UNIT_STEP_S2,
    LOAD_FULL,
    MULTI_TURN_FEEDBACK,
    STEPS_PER_REV,
    FeetechMode,
    TorqueSwitch,
)
from sim_twin.servos.feetech.memory import FeetechMemory
from sim_twin.servos.firmware.coupling import Coupling
from sim_twin.servos.firmware.profile import UNBOUNDED, Floats, SetpointProfile

POSITION_GAIN: Final = 1 / 1600
"""Duty per step of error and unit of P."""
_DAMPING_S: Final = 0.01
_VELOCITY_P: Final = 5e-5
_VELOCITY_I_PER_S: Final = 5e-5
_INTEGRAL_UNIT: Final = 4 / LOAD_FULL
_COARSE_STEP_S: Final = 50.0
"""Unit of speeds where phase does not choose 1 step/s: 0.732 rpm."""
_FURTHEST_STEP: Final = 32_767.0
_DRIVE_REVERSED, _FINE_SPEEDS, _ZERO_SPEED_IS_MAX, _FEEDBACK_REVERSED = 0x01, 0x04, 0x08, 0x80

Rows = NDArray[np.intp]


class FeetechMotion:
    """Run the control loops; `steps`, `speed_step_s` and `pwm` are the latest results.

    `steps` is what a servo shows. It wraps at one turn unless phase asks for more turns; the loop
    follows it, or the turns counted where no position limits are set and in step mode.
    """

    def __init__(self, memory: FeetechMemory, coupling: Coupling) -> None:
        count = len(memory)
        self._memory = memory
        self._coupling = coupling
        self._step_rad = np.array([sheet.step_rad for sheet in memory.sheets])
        self._centre = np.array([float(sheet.centre_step) for sheet in memory.sheets])
        self._goes_round = np.array([s.steps_per_rev == STEPS_PER_REV for s in memory.sheets])
        self._last_step = np.where(self._goes_round, STEPS_PER_REV - 1.0, 2.0 * self._centre + 1.0)
        self._profile = SetpointProfile(count)
        self._turn_steps = np.zeros(count)
        self._counted = self._centre.copy()
        self._measured = self._centre.copy()
        self._stepped_goal = self._centre.copy()
        self._last_setpoint = self._centre.copy()
        self._position_sum = np.zeros(count)
        self._velocity_sum = np.zeros(count)
        self._ramped_step_s = np.zeros(count)
        self._nominal_ratio: Floats = np.ones(count)
        self._none = np.zeros(count)
        self.steps = self._centre.copy()
        self.speed_step_s = np.zeros(count)
        self.pwm = np.zeros(count)
        self.cap: Floats = np.ones(count)
        """The largest duty that protection allows."""
        self.reload()

    def reload(self) -> None:
        """Take over registers that the host or the firmware changed."""
        column, phase = self._memory.column, self._memory.column("phase")
        self._feedback = np.where(phase & _FEEDBACK_REVERSED, -1.0, 1.0)
        self._drive = np.where(phase & _DRIVE_REVERSED, -1.0, 1.0)
        steps_per_rad = self._feedback / self._step_rad
        self._steps_per_joint = steps_per_rad * self._coupling.rad_per_joint
        self._offset = self._centre + self._turn_steps - column("homing_offset")
        self._offset -= steps_per_rad * self._coupling.zero_rad
        self._enabled = (column("torque_enable") == TorqueSwitch.ON).astype(np.float64)
        self._any_enabled = bool(self._enabled.any())
        self._speed_unit = np.where(phase & _FINE_SPEEDS, 1.0, _COARSE_STEP_S)
        self._reload_modes(phase)
        self._reload_gains()
        self.reload_goals()

    def _reload_modes(self, phase: NDArray[np.int64]) -> None:
        column, mode = self._memory.column, self._memory.column("operating_mode")
        self._in_step_mode = mode == FeetechMode.STEP
        self._velocity_rows = np.flatnonzero(mode == FeetechMode.VELOCITY)
        self._pwm_rows = np.flatnonzero(mode == FeetechMode.PWM)
        low, high = column("min_position_limit"), column("max_position_limit")
        unlimited = (low == 0) & (high == 0)
        self._shows_turns = ((phase & MULTI_TURN_FEEDBACK) != 0) & self._goes_round
        self._counts_turns = self._shows_turns | self._in_step_mode | unlimited
        self._counts_turns &= self._goes_round
        self._measured = np.where(self._counts_turns, self._counted, self.steps)
        free = unlimited | self._in_step_mode
        high = np.where(self._goes_round, high, np.minimum(high, self._last_step))
        self._lowest = np.where(free, -_FURTHEST_STEP, low)
        self._highest = np.where(free, _FURTHEST_STEP, np.maximum(low, high))
        self._zero_speed = np.where(phase & _ZERO_SPEED_IS_MAX, UNBOUNDED, 0.0)

    def _reload_gains(self) -> None:
        column = self._memory.column
        self._p = column("position_p_gain") * POSITION_GAIN
        self._i = column("position_i_gain") * POSITION_GAIN
        self._d = column("position_d_gain") * (POSITION_GAIN * _DAMPING_S)
        self._has_i = bool(self._i.any())
        bound = column("integral_limit") * _INTEGRAL_UNIT
        self._integral_bound = np.where(bound > 0.0, np.minimum(bound, 1.0), 1.0)
        self._cw_dead, self._ccw_dead = column("cw_dead_zone"), -column("ccw_dead_zone")

    def reload_goals(self) -> None:
        """Take over goals, and what limits speed, acceleration and torque on the way to them."""
        column = self._memory.column
        goal = np.where(self._in_step_mode, self._stepped_goal, column("goal_position"))
        self.goal = np.clip(goal, self._lowest, self._highest)
        self._torque_limit = np.minimum(column("torque_limit") / LOAD_FULL, 1.0)
        self._goal_step_s = column("goal_velocity") * self._speed_unit
        self._goal_duty = column("goal_time") / LOAD_FULL
        speed = np.abs(self._goal_step_s)
        limit = column("max_velocity_limit") * _COARSE_STEP_S
        speed = np.where(speed > 0.0, speed, self._zero_speed)
        speed = np.minimum(speed, np.where(limit > 0.0, limit, UNBOUNDED))
        asked, most = column("acceleration"), column("max_acceleration")
        asked = np.where(asked == 0, most, np.where(most > 0, np.minimum(asked, most), asked))
        ramp = np.where(asked > 0, asked * ACCELERATION_UNIT_STEP_S2, UNBOUNDED)
        self._ramp_step_s2 = ramp
        self._profile.limit(speed, ramp)

    def set_voltage(self, nominal_ratio: Floats) -> None:
        """Take over the supply's voltage, as a share of each motor's nominal one."""
        self._nominal_ratio = nominal_ratio

    @property
    def shaft_duty(self) -> Floats:
        """Return the share of the supply that is put on the motors, in shaft coordinates."""
        duty: Floats = self.pwm * self._drive
        return duty

    @property
    def shaft_rad_s(self) -> Floats:
        """Return the shafts' speeds."""
        speed: Floats = self.speed_step_s * self._feedback * self._step_rad
        return speed

    @property
    def speed_units(self) -> Floats:
        """Return the speeds as the registers count them."""
        speed: Floats = self.speed_step_s / self._speed_unit
        return speed

    def sense(self, joint_motion: Floats) -> None:
        """Read the encoders: the joints' positions in the first row, their speeds in the second."""
        self.speed_step_s = joint_motion[1] * self._steps_per_joint
        self._counted = np.rint(joint_motion[0] * self._steps_per_joint + self._offset)
        wrapped = np.mod(self._counted, STEPS_PER_REV)
        if not self._goes_round.all():
            within = np.clip(self._counted, 0.0, self._last_step)
            wrapped = np.where(self._goes_round, wrapped, within)
        self.steps = np.where(self._shows_turns, self._counted, wrapped)
        self._measured = np.where(self._counts_turns, self._counted, self.steps)

    def home(self, rows: list[int]) -> None:
        """Forget the turns counted: the count comes back to one turn."""
        for row in rows:
            if self._goes_round[row]:
                turns = np.floor(self._counted[row] / STEPS_PER_REV)
                self._turn_steps[row] -= turns * STEPS_PER_REV

    def restart(self, row: int) -> None:
        """Begin anew from the present position, with empty integrals."""
        self._profile.restart(row, self._measured[row])
        self._last_setpoint[row] = self._measured[row]
        self._stepped_goal[row] = self._counted[row]
        self._position_sum[row] = self._velocity_sum[row] = 0.0
        self._ramped_step_s[row] = self.speed_step_s[row]

    def step_on(self, row: int, steps: int) -> None:
        """Move the goal of step mode on."""
        self._stepped_goal[row] += steps

    def advance(self, dt_s: float) -> Floats:
        """Return the duty for the next `dt_s`, -1..1 of nominal voltage, as the joints have it."""
        if not self._any_enabled:
            self.pwm = self._none
            return self._none
        self._profile.lead(self.goal, dt_s)
        pwm = self._position_pwm(dt_s)
        if self._velocity_rows.size:
            pwm[self._velocity_rows] = self._velocity_pwm(self._velocity_rows, dt_s)
        if self._pwm_rows.size:
            pwm[self._pwm_rows] = self._goal_duty[self._pwm_rows]
        cap = np.minimum(self._torque_limit, self.cap)
        self.pwm = np.minimum(np.maximum(pwm, -cap), cap) * self._enabled
        duty: Floats = self.pwm * (self._drive * self._coupling.sign * self._nominal_ratio)
        return duty

    def _position_pwm(self, dt_s: float) -> Floats:
        setpoint = self._profile.position
        error = setpoint - self._measured
        error[(error <= self._cw_dead) & (error >= self._ccw_dead)] = 0.0
        rate = (setpoint - self._last_setpoint) / dt_s
        self._last_setpoint = setpoint.copy()
        pwm: Floats = error * self._p + (rate - self.speed_step_s) * self._d
        if self._has_i:
            bound = self._integral_bound
            self._position_sum = np.clip(
                self._position_sum + error * self._i * dt_s * self._enabled, -bound, bound
            )
            pwm += self._position_sum
        return pwm

    def _velocity_pwm(self, rows: Rows, dt_s: float) -> Floats:
        ramp, before = self._ramp_step_s2[rows] * dt_s, self._ramped_step_s[rows]
        asked = np.clip(self._goal_step_s[rows], before - ramp, before + ramp)
        self._ramped_step_s[rows] = asked
        error = asked - self.speed_step_s[rows]
        gain = self._memory.column("velocity_i_gain")[rows] * _VELOCITY_I_PER_S
        total = self._velocity_sum[rows] + error * gain * dt_s * self._enabled[rows]
        self._velocity_sum[rows] = total = np.clip(total, -1.0, 1.0)
        pwm: Floats = error * self._memory.column("velocity_p_gain")[rows] * _VELOCITY_P + total
        return pwm
