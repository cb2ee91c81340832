"""Find each cause in one tick's inputs: one pure function per cause, None when it is absent."""

from typing import Final

import numpy as np

from vla_deploy.safety.findings import Finding, first_in, first_joint, joint_finding, stale
from vla_deploy.safety.inputs import Flags, Floats, SafetyInputs, SafetyLimits

EVERY_SERVO: Final = "every servo"


def estop(inputs: SafetyInputs, limits: SafetyLimits) -> Finding | None:
    """Find a request for an emergency stop from any source."""
    return None if inputs.estop_source is None else Finding(subject=inputs.estop_source)


def joint_position_limit(inputs: SafetyInputs, limits: SafetyLimits) -> Finding | None:
    """Find a powered joint beyond its range that is still moving outward."""
    above, below = (
        inputs.position > limits.position_upper,
        inputs.position < limits.position_lower,
    )
    if first_in(above | below) is None:
        return None
    above &= inputs.velocity > limits.outward_velocity
    below &= inputs.velocity < -limits.outward_velocity
    joint = first_in((above | below) & inputs.torque_enabled)
    if joint is None:
        return None
    bound = limits.position_upper if above[joint] else limits.position_lower
    return joint_finding(joint, inputs.position, bound, inputs.sample_age_s, limits)


def joint_velocity_limit(inputs: SafetyInputs, limits: SafetyLimits) -> Finding | None:
    """Find a powered joint that is faster than allowed."""
    return _powered_above(np.abs(inputs.velocity), limits.velocity, inputs, limits)


def joint_unpowered(inputs: SafetyInputs, limits: SafetyLimits) -> Finding | None:
    """Find joints that let go though nobody has taken their power; the first is named."""
    loose = inputs.powered & ~inputs.torque_enabled
    joint = first_in(loose)
    if joint is None:
        return None
    return Finding(
        subject=limits.joint_names[joint],
        measured=float(np.count_nonzero(loose)),
        limit=0.0,
        age_s=float(inputs.sample_age_s[joint]),
    )


def encoder_jump(inputs: SafetyInputs, limits: SafetyLimits) -> Finding | None:
    """Find a powered joint that is said to have gone further than any joint can in that time."""
    joint = first_in(jumped_joints(inputs, limits))
    if joint is None:
        return None
    step, allowed = np.abs(inputs.position_step), _possible_step(inputs, limits)
    return joint_finding(joint, step, allowed, inputs.sample_age_s, limits)


def jumped_joints(inputs: SafetyInputs, limits: SafetyLimits) -> Flags:
    """Return which powered joints `encoder_jump` finds: their setpoints are where no joint is."""
    beyond: Flags = np.abs(inputs.position_step) > _possible_step(inputs, limits)
    return beyond & inputs.torque_enabled


def following_error(inputs: SafetyInputs, limits: SafetyLimits) -> Finding | None:
    """Find a powered joint that is too far from its setpoint."""
    error = np.abs(inputs.position - inputs.setpoint)
    return _powered_above(error, limits.following_error, inputs, limits)


def joint_current_limit(inputs: SafetyInputs, limits: SafetyLimits) -> Finding | None:
    """Find a powered joint whose motor takes more of its stall current than allowed."""
    return _powered_above(np.abs(inputs.effort_ratio), limits.effort_ratio, inputs, limits)


def joint_temperature_limit(inputs: SafetyInputs, limits: SafetyLimits) -> Finding | None:
    """Find a servo that is hotter than allowed; its own shutdown comes later."""
    hot = inputs.temperature_c > limits.temperature_c
    return first_joint(
        hot, inputs.temperature_c, limits.temperature_c, inputs.climate_age_s, limits
    )


def joint_voltage_limit(inputs: SafetyInputs, limits: SafetyLimits) -> Finding | None:
    """Find a servo whose supply is lower or higher than allowed."""
    low = inputs.voltage_v < limits.voltage_min_v
    high = inputs.voltage_v > limits.voltage_max_v
    joint = first_in(low | high)
    if joint is None:
        return None
    bound = limits.voltage_min_v if low[joint] else limits.voltage_max_v
    return joint_finding(joint, inputs.voltage_v, bound, inputs.climate_age_s, limits)


def standstill_motion(inputs: SafetyInputs, limits: SafetyLimits) -> Finding | None:
    """Find what moves under power while the robot has to stand still.

    A speed that nobody measures any more shows nothing: that it is old is a finding of its own.
    """
    if not inputs.standstill:
        return None
    for drive in inputs.drives if inputs.base_powered else ():
        speed = abs(drive.measured_rad_s)
        if speed > limits.standstill_wheel_rad_s:
            return Finding(
                subject=drive.name,
                measured=speed,
                limit=limits.standstill_wheel_rad_s,
                age_s=drive.age_s,
            )
    is_old = inputs.sample_age_s > limits.servo_age_s
    speed_rad_s = np.where(is_old, 0.0, np.abs(inputs.velocity))
    return _powered_above(speed_rad_s, limits.standstill_velocity, inputs, limits)


def wheel_following_error(inputs: SafetyInputs, limits: SafetyLimits) -> Finding | None:
    """Find a wheel that turns slower, faster or the other way than commanded."""
    for drive in inputs.drives:
        error = abs(drive.measured_rad_s - drive.commanded_rad_s)
        allowed = limits.wheel_error_rad_s + limits.wheel_error_ratio * abs(drive.commanded_rad_s)
        if error > allowed:
            return Finding(subject=drive.name, measured=error, limit=allowed, age_s=drive.age_s)
    return None


def servo_hardware_error(inputs: SafetyInputs, limits: SafetyLimits) -> Finding | None:
    """Find a servo that reports a hardware error of its own."""
    if not np.count_nonzero(inputs.hardware_error):
        return None
    joint = int(inputs.hardware_error.argmax())
    return Finding(
        subject=limits.joint_names[joint],
        measured=float(inputs.hardware_error[joint]),
        limit=0.0,
        age_s=float(inputs.sample_age_s[joint]),
    )


def servo_bus_lost(inputs: SafetyInputs, limits: SafetyLimits) -> Finding | None:
    """Find a servo bus whose link is gone, or servos that have been silent for too long.

    Where all are silent, the cause is not one of them.
    """
    if inputs.lost_servo_buses:
        return Finding(subject=inputs.lost_servo_buses[0])
    joint = int(inputs.sample_age_s.argmax())
    age_s = float(inputs.sample_age_s[joint])
    if age_s <= limits.servo_age_s:
        return None
    all_silent = inputs.sample_age_s.min() > limits.servo_age_s
    return Finding(
        subject=EVERY_SERVO if all_silent else limits.joint_names[joint],
        measured=age_s,
        limit=limits.servo_age_s,
        age_s=age_s,
    )


def servo_watchdog_tripped(inputs: SafetyInputs, limits: SafetyLimits) -> Finding | None:
    """Find servos that their Bus Watchdog has stopped; the first is named, all are counted."""
    joint = first_in(inputs.watchdog_tripped)
    if joint is None:
        return None
    return Finding(
        subject=limits.joint_names[joint],
        measured=float(np.count_nonzero(inputs.watchdog_tripped)),
        limit=0.0,
        age_s=float(inputs.sample_age_s[joint]),
    )


def can_bus_lost(inputs: SafetyInputs, limits: SafetyLimits) -> Finding | None:
    """Find a CAN bus whose link is gone, or a wheel drive that its driver calls lost."""
    if inputs.lost_can_buses:
        return Finding(subject=inputs.lost_can_buses[0])
    for drive in inputs.drives:
        if drive.lost:
            return Finding(
                subject=drive.name,
                measured=drive.age_s,
                limit=drive.age_limit_s,
                age_s=drive.age_s,
            )
    return None


def drive_fault(inputs: SafetyInputs, limits: SafetyLimits) -> Finding | None:
    """Find a wheel drive that reports a fault."""
    for drive in inputs.drives:
        if drive.fault_code != 0:
            return Finding(
                subject=drive.name,
                measured=float(drive.fault_code),
                limit=0.0,
                age_s=drive.age_s,
            )
    return None


def stale_command(inputs: SafetyInputs, limits: SafetyLimits) -> Finding | None:
    """Find a moving base whose command is too old."""
    return stale(
        "base_command",
        inputs.base_command_age_s if inputs.base_moving else None,
        limits.base_command_age_s,
    )


def supervisor_lost(inputs: SafetyInputs, limits: SafetyLimits) -> Finding | None:
    """Find a process table that its supervisor no longer refreshes."""
    return stale("supervisor", inputs.supervisor_age_s, limits.supervisor_age_s)


def budget_exhausted(inputs: SafetyInputs, limits: SafetyLimits) -> Finding | None:
    """Find a budget whose last step is the protective stop."""
    return None if inputs.budget_stop is None else Finding(subject=inputs.budget_stop)


def _possible_step(inputs: SafetyInputs, limits: SafetyLimits) -> Floats:
    return limits.velocity * inputs.step_time_s + limits.position_jump


def _powered_above(
    measured: Floats, limit: Floats, inputs: SafetyInputs, limits: SafetyLimits
) -> Finding | None:
    beyond = (measured > limit) & inputs.torque_enabled
    return first_joint(beyond, measured, limit, inputs.sample_age_s, limits)
