"""Find each cause in one tick's inputs: one pure function per cause, None when it is absent."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

import numpy as np

from vla_deploy.safety.inputs import Flags, Floats, SafetyInputs, SafetyLimits

EVERY_SERVO: Final = "every servo"


@dataclass(frozen=True, slots=True, kw_only=True)
class Finding:
    """Say who is affected, what was measured and what was allowed; NaN where no number applies."""

    subject: str
    measured: float = float("nan")
    limit: float = float("nan")
    age_s: float = 0.0


Probe = Callable[[SafetyInputs, SafetyLimits], Finding | None]


def estop(inputs: SafetyInputs, limits: SafetyLimits) -> Finding | None:
    """Find a request for an emergency stop from any source."""
    return None if inputs.estop_source is None else Finding(subject=inputs.estop_source)


def joint_position_limit(inputs: SafetyInputs, limits: SafetyLimits) -> Finding | None:
    """Find a powered joint beyond its range that is still moving outward."""
    above = (inputs.position > limits.position_upper) & (inputs.velocity > limits.outward_velocity)
    below = (inputs.position < limits.position_lower) & (inputs.velocity < -limits.outward_velocity)
    outside = (above | below) & inputs.torque_enabled
    bound = np.where(above, limits.position_upper, limits.position_lower)
    return _first_joint(outside, inputs.position, bound, limits)


def joint_velocity_limit(inputs: SafetyInputs, limits: SafetyLimits) -> Finding | None:
    """Find a powered joint that is faster than allowed."""
    speed = np.abs(inputs.velocity)
    return _first_joint(
        (speed > limits.velocity) & inputs.torque_enabled, speed, limits.velocity, limits
    )


def following_error(inputs: SafetyInputs, limits: SafetyLimits) -> Finding | None:
    """Find a powered joint that is too far from its setpoint."""
    error = np.abs(inputs.position - inputs.setpoint)
    return _first_joint(
        (error > limits.following_error) & inputs.torque_enabled,
        error,
        limits.following_error,
        limits,
    )


def wheel_following_error(inputs: SafetyInputs, limits: SafetyLimits) -> Finding | None:
    """Find a wheel that turns slower, faster or the other way than commanded."""
    for drive in inputs.drives:
        error = abs(drive.measured_rad_s - drive.commanded_rad_s)
        allowed = limits.wheel_error_rad_s + limits.wheel_error_ratio * abs(drive.commanded_rad_s)
        if error > allowed:
            return Finding(subject=drive.name, measured=error, limit=allowed)
    return None


def servo_hardware_error(inputs: SafetyInputs, limits: SafetyLimits) -> Finding | None:
    """Find a servo that reports a hardware error of its own."""
    if not inputs.hardware_error.any():
        return None
    joint = int(inputs.hardware_error.argmax())
    return Finding(
        subject=limits.joint_names[joint], measured=float(inputs.hardware_error[joint]), limit=0.0
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
    """Find a servo whose Bus Watchdog has stopped it."""
    if not inputs.watchdog_tripped.any():
        return None
    return Finding(subject=limits.joint_names[int(inputs.watchdog_tripped.argmax())])


def can_bus_lost(inputs: SafetyInputs, limits: SafetyLimits) -> Finding | None:
    """Find a CAN bus whose link is gone, or a wheel drive that its driver calls lost."""
    if inputs.lost_can_buses:
        return Finding(subject=inputs.lost_can_buses[0])
    for drive in inputs.drives:
        if drive.lost:
            return Finding(subject=drive.name, measured=drive.age_s, age_s=drive.age_s)
    return None


def drive_fault(inputs: SafetyInputs, limits: SafetyLimits) -> Finding | None:
    """Find a wheel drive that reports a fault."""
    for drive in inputs.drives:
        if drive.fault_code != 0:
            return Finding(subject=drive.name, measured=float(drive.fault_code), limit=0.0)
    return None


def stale_command(inputs: SafetyInputs, limits: SafetyLimits) -> Finding | None:
    """Find a moving base whose command is too old."""
    return _stale(
        "base_command",
        inputs.base_command_age_s if inputs.base_moving else None,
        limits.base_command_age_s,
    )


def supervisor_lost(inputs: SafetyInputs, limits: SafetyLimits) -> Finding | None:
    """Find a process table that its supervisor no longer refreshes."""
    return _stale("supervisor", inputs.supervisor_age_s, limits.supervisor_age_s)


def _stale(subject: str, age_s: float | None, limit_s: float) -> Finding | None:
    if age_s is None or age_s <= limit_s:
        return None
    return Finding(subject=subject, measured=age_s, limit=limit_s, age_s=age_s)


def _first_joint(
    mask: Flags, measured: Floats, limit: Floats, limits: SafetyLimits
) -> Finding | None:
    if not mask.any():
        return None
    joint = int(mask.argmax())
    return Finding(
        subject=limits.joint_names[joint],
        measured=float(measured[joint]),
        limit=float(limit[joint]),
    )
