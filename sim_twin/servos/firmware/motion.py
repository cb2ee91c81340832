"""Turn goals into motor duty as the servo's control loops do, for all servos of a bus at once.

Positions are pulses, velocities register units, outputs PWM units (885 = full). Gains as in the
e-manual: position P/128, I/65536, D/16, feed-forward of the setpoint's velocity and acceleration
/4; velocity P/128, I/65536; integrals and derivatives count in milliseconds, which the manual
leaves open. The current loop is taken as ideal: it asks for the duty at which the motor, at its
present speed and voltage, draws the goal current.
"""

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from drivers.dynamixel.tables.model import (
    PULSE_RAD,
    PULSES_PER_REV,
    PWM_FULL,
    OperatingMode,
)
from sim_twin.servos.firmware.columns import TableColumns
from sim_twin.servos.firmware.coupling import Coupling
from sim_twin.servos.firmware.profile import (
    PULSES_S2_PER_UNIT,
    PULSES_S_PER_UNIT,
    Floats,
    TrajectoryProfile,
)
from sim_twin.servos.protocol.register_file import RegisterFile

CENTRE_PULSES: Final = PULSES_PER_REV // 2
_REVERSE: Final = 0x01
_MS_PER_S: Final = 1e3
_LEAST_RATIO: Final = 0.1
_POSITION_MODES: Final = (
    OperatingMode.POSITION,
    OperatingMode.EXTENDED_POSITION,
    OperatingMode.CURRENT_BASED_POSITION,
)

Rows = NDArray[np.intp]

_add, _subtract, _multiply = np.add, np.subtract, np.multiply
_rint, _minimum, _maximum = np.rint, np.minimum, np.maximum


@dataclass(frozen=True, slots=True, kw_only=True)
class Motors:
    """Hold what the control loops know of each motor, from its model."""

    stall_nm: Floats
    no_load_rad_s: Floats
    effort_unit_ratio: Floats
    velocity_unit_rad_s: Floats
    senses_supply_current: NDArray[np.bool_]

    @classmethod
    def of(cls, registers: RegisterFile) -> "Motors":
        """Collect the figures of the models on the bus."""
        models = [table.model for table in registers.tables]
        return cls(
            stall_nm=np.array([m.stall_torque_nm for m in models]),
            no_load_rad_s=np.array([m.no_load_speed_rad_s for m in models]),
            effort_unit_ratio=np.array([m.effort_unit_ratio for m in models]),
            velocity_unit_rad_s=np.array([m.velocity_unit_rad_s for m in models]),
            senses_supply_current=np.array([m.senses_supply_current for m in models]),
        )


class ServoMotion:
    """Run the control loops; `pulses`, `velocity_rad_s` and `pwm` are the latest results.

    Positions and efforts come in, and duties go out, as the joints have them: the scales between
    joint, shaft and register are multiplied beforehand, for every array operation of a step counts.
    """

    def __init__(self, registers: RegisterFile, columns: TableColumns, coupling: Coupling) -> None:
        count = len(registers)
        self._columns = columns
        self._coupling = coupling
        self._motors = Motors.of(registers)
        self._joint_stall_nm = self._motors.stall_nm * coupling.sign
        self.profile = TrajectoryProfile(columns)
        self.pulses = np.full(count, float(CENTRE_PULSES))
        # Position and speed are rows of one array, so that one operation does for both.
        self._sensed = np.zeros((2, count))
        self._turned, self.shaft_rad_s = self._sensed
        self._per_joint = np.zeros((2, count))
        self._per_joint[1] = coupling.rad_per_joint
        self._gains = np.zeros((2, count))
        self._terms = np.zeros((2, count))
        self._by_position, self._by_speed = self._terms
        self._pwm = np.zeros(count)
        self._duty = np.zeros(count)
        self._duty_per_pwm = np.zeros(count)
        self._no_duty = np.zeros(count)
        self.goals_moved = True
        """Set this when goal positions have changed."""
        self._nominal_ratio: Floats = np.ones(count)
        self._turn_pulses = np.zeros(count)
        self._last_setpoint = np.zeros(count)
        self._change = np.zeros(count)
        self._last_change = np.zeros(count)
        self._position_sum = np.zeros(count)
        self._velocity_sum = np.zeros(count)
        self.ramped_velocity = np.zeros(count)
        self.reload()

    def reload(self) -> None:
        """Take over registers that the host or the firmware changed."""
        columns = self._columns
        self.profile.reload()
        self.direction = np.where(columns.drive_mode & _REVERSE, -1.0, 1.0)
        pulses_per_rad = self.direction / PULSE_RAD
        self._per_joint[0] = pulses_per_rad * self._coupling.rad_per_joint
        self._offset_pulses = CENTRE_PULSES + self._turn_pulses + columns.homing_offset
        self._offset_pulses -= pulses_per_rad * self._coupling.zero_rad
        enabled = columns.torque_enable != 0
        self._enabled = enabled.astype(np.float64)
        self._any_enabled = bool(enabled.any())
        self.goals_moved = True
        self._share_per_pwm = self._enabled * self.direction / PWM_FULL
        self._joint_share_per_pwm = self._share_per_pwm * self._coupling.sign
        self.set_voltage(self._nominal_ratio)
        self._gains[0] = columns.position_p_gain / 128.0
        self._i = columns.position_i_gain / 65536.0
        d_gain = columns.position_d_gain / 16.0
        self._gains[1] = d_gain * self.direction / (PULSE_RAD * _MS_PER_S)
        self._forward = d_gain + columns.feedforward_1st_gain / 4.0
        self._forward_2nd = columns.feedforward_2nd_gain / 4.0
        self._has_i = bool(self._i.any())
        self._has_2nd = bool(self._forward_2nd.any())
        self._has_rates = self._has_2nd or bool(self._forward.any())
        self._reload_modes()

    def _reload_modes(self) -> None:
        columns, mode = self._columns, self._columns.operating_mode
        in_pwm = mode == OperatingMode.PWM
        limit = np.minimum(columns.pwm_limit, np.abs(columns.goal_pwm))
        self._pwm_limit = np.where(in_pwm, columns.pwm_limit, limit).astype(np.float64)
        self._least_pwm = -self._pwm_limit
        self._velocity_rows = np.flatnonzero(mode == OperatingMode.VELOCITY)
        self._pwm_rows = np.flatnonzero(in_pwm)
        self._torque_rows = np.flatnonzero(mode == OperatingMode.CURRENT)
        self._limited_rows = np.flatnonzero(mode == OperatingMode.CURRENT_BASED_POSITION)
        self.in_position_mode = np.isin(mode, _POSITION_MODES)
        others = (self._velocity_rows, self._pwm_rows, self._torque_rows, self._limited_rows)
        self._all_by_position = not any(rows.size for rows in others)

    def set_voltage(self, nominal_ratio: Floats) -> None:
        """Take over the supply's voltage, as a share of each motor's nominal one.

        Duty counts from the nominal voltage: a lower one does less with the same PWM.
        """
        self._nominal_ratio = nominal_ratio
        _multiply(self._joint_share_per_pwm, nominal_ratio, self._duty_per_pwm)

    @property
    def duty(self) -> Floats:
        """Return the share of the supply that is put on the motors, in shaft coordinates."""
        duty: Floats = self._pwm * self._share_per_pwm
        return duty

    @property
    def velocity_rad_s(self) -> Floats:
        """Return the measured velocities."""
        velocity: Floats = self.shaft_rad_s * self.direction
        return velocity

    @property
    def pwm(self) -> Floats:
        """Return what is put on the motors."""
        pwm: Floats = self._pwm * self._enabled
        return pwm

    def sense(self, joint_motion: Floats) -> None:
        """Read the encoders: the joints' positions in the first row, their speeds in the second."""
        turned = self._turned
        _multiply(joint_motion, self._per_joint, self._sensed)
        _add(turned, self._offset_pulses, turned)
        _rint(turned, self.pulses)

    def home(self, row: int) -> None:
        """Forget the turns counted, as at power-on: the position comes back to 0..4095."""
        offset = float(self._columns.homing_offset[row])
        turns = np.floor((self.pulses[row] - offset) / PULSES_PER_REV)
        self._turn_pulses[row] -= turns * PULSES_PER_REV
        self.pulses[row] -= turns * PULSES_PER_REV
        self._columns.goal_position[row] = self.pulses[row]
        self.restart(row)

    def restart(self, row: int) -> None:
        """Begin anew from the present position and velocity, with empty integrals."""
        self.profile.restart(row, self.pulses[row])
        self._last_setpoint[row] = self.pulses[row]
        self._last_change[row] = 0.0
        self._position_sum[row] = 0.0
        self._velocity_sum[row] = 0.0
        self.ramped_velocity[row] = 0.0

    def advance(self, dt_s: float) -> Floats:
        """Return the duty for the next `dt_s`, -1..1 of nominal voltage, as the joints have it."""
        pwm = self._pwm
        if not self._any_enabled:
            pwm[:] = 0.0
            return self._no_duty
        self._control_position(dt_s)
        if not self._all_by_position:
            self._control_other_modes(dt_s)
        _minimum(pwm, self._pwm_limit, out=pwm)
        _maximum(pwm, self._least_pwm, out=pwm)
        _multiply(pwm, self._duty_per_pwm, self._duty)
        return self._duty

    def _control_other_modes(self, dt_s: float) -> None:
        pwm = self._pwm
        if self._velocity_rows.size:
            pwm[self._velocity_rows] = self._velocity_pwm(self._velocity_rows, dt_s)
        if self._pwm_rows.size:
            pwm[self._pwm_rows] = self._columns.goal_pwm[self._pwm_rows]
        if self._torque_rows.size or self._limited_rows.size:
            self._limit_current(pwm)

    def _control_position(self, dt_s: float) -> None:
        """Set `pwm` to what the position loops ask for, in place: every step comes here."""
        error = self._turned
        moving = self.goals_moved or self.profile.active or self._has_2nd
        if moving:
            self.goals_moved = False
            self.profile.advance(dt_s)
        _subtract(self.profile.position, self.pulses, error)
        _multiply(self._sensed, self._gains, self._terms)
        _subtract(self._by_position, self._by_speed, self._pwm)
        if self._has_i:
            self._integrate_position(error, dt_s)
        if moving:
            self._feed_forward(dt_s * _MS_PER_S)

    def _integrate_position(self, error: Floats, dt_s: float) -> None:
        self._position_sum += error * (dt_s * _MS_PER_S)
        bound = PWM_FULL / np.maximum(self._i, 1e-9)
        self._position_sum = np.clip(self._position_sum, -bound, bound)
        self._pwm += self._position_sum * self._i

    def _feed_forward(self, dt_ms: float) -> None:
        """Add what the setpoint's rates of change call for: of D, and of the feed-forward gains."""
        change, position = self._change, self.profile.position
        _subtract(position, self._last_setpoint, change)
        self._last_setpoint[:] = position
        if self._has_2nd:
            self._pwm += (change - self._last_change) * (self._forward_2nd / dt_ms**2)
            self._last_change[:] = change
        if self._has_rates:
            change /= dt_ms
            change *= self._forward
            self._pwm += change

    def _velocity_pwm(self, rows: Rows, dt_s: float) -> Floats:
        columns = self._columns
        goal = columns.goal_velocity[rows].astype(np.float64)
        ramp = columns.profile_acceleration[rows] * (PULSES_S2_PER_UNIT / PULSES_S_PER_UNIT * dt_s)
        ramp[ramp == 0.0] = np.inf
        before = self.ramped_velocity[rows]
        asked = np.clip(goal, before - ramp, before + ramp)
        self.ramped_velocity[rows] = asked
        error = asked - self.velocity_rad_s[rows] / self._motors.velocity_unit_rad_s[rows]
        i_gain = columns.velocity_i_gain[rows] / 65536.0
        bound = PWM_FULL / np.maximum(i_gain, 1e-9)
        total = np.clip(self._velocity_sum[rows] + error * dt_s * _MS_PER_S, -bound, bound)
        self._velocity_sum[rows] = total
        return error * (columns.velocity_p_gain[rows] / 128.0) + total * i_gain

    def _limit_current(self, pwm: Floats) -> None:
        columns = self._columns
        allowed = np.minimum(np.abs(columns.goal_current), columns.current_limit)
        full_pwm = PWM_FULL / np.maximum(self._nominal_ratio, _LEAST_RATIO)
        allowed_pwm = allowed * self._motors.effort_unit_ratio * full_pwm
        back_emf_pwm = self.velocity_rad_s / self._motors.no_load_rad_s * full_pwm
        rows = self._torque_rows
        asked = np.sign(columns.goal_current[rows]) * allowed_pwm[rows]
        pwm[rows] = back_emf_pwm[rows] + asked
        rows = self._limited_rows
        low, high = back_emf_pwm[rows] - allowed_pwm[rows], back_emf_pwm[rows] + allowed_pwm[rows]
        pwm[rows] = np.clip(pwm[rows], low, high)

    def effort_ratio(self, joint_effort: Floats) -> Floats:
        """Return the current behind a torque, as a share of the stall current."""
        ratio: Floats = joint_effort / self._joint_stall_nm
        return ratio

    def present_effort(self, joint_effort: Floats) -> Floats:
        """Return what address 126 shows: current, or load where the model senses none.

        An X330 senses what it draws from the supply: the motor's current by the bridge's duty.
        """
        ratio = self.effort_ratio(joint_effort) * self.direction
        drawn = ratio * (np.abs(self.pwm) / PWM_FULL)
        sensed = np.where(self._motors.senses_supply_current, drawn, ratio)
        return sensed / self._motors.effort_unit_ratio

    def present_velocity(self) -> Floats:
        """Return the measured velocity in register units."""
        return self.velocity_rad_s / self._motors.velocity_unit_rad_s
