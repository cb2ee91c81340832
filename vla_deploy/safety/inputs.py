"""Declare what the judge sees each tick and the limits it judges by: values only."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vla_deploy.safety.surroundings import NOTHING_KNOWN, Surroundings

Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]


@dataclass(frozen=True, slots=True, kw_only=True)
class DriveSample:
    """Describe one wheel drive; its driver judges whether it is `lost`, `fault_code` 0 is none.

    A silent one is lost beyond `age_limit_s`, one that has restarted at once. Both speeds are means
    over the same short time; they are equal where the drive need not follow.
    """

    name: str
    lost: bool
    age_s: float
    age_limit_s: float
    fault_code: int
    commanded_rad_s: float
    measured_rad_s: float


@dataclass(frozen=True, slots=True, kw_only=True)
class SafetyInputs:
    """Carry one tick's measurements, joint arrays in the order of the robot file.

    `energised` is true from arming until the robot is disarmed again, `standstill` while it has to
    stand under a stop. `powered` are the joints that have come under power since arming began, none
    once a stop has latched, for that may take it; `torque_enabled` is what each servo says.
    `position_step` is what a joint has gone since its sample before this one, `step_time_s` the
    time between both; both are 0 where no new one came. `effort_ratio` is of the stall current;
    voltage and temperature are NaN before the first reading, and are read less often than the rest:
    `climate_age_s`.
    `budget_stop` says which budget demands a stop.
    An age of None means that nothing has ever arrived, so there is nothing to lose yet.
    """

    energised: bool
    estop_source: str | None
    reset_requested: bool
    position: Floats
    velocity: Floats
    position_step: Floats
    step_time_s: Floats
    setpoint: Floats
    powered: Flags
    torque_enabled: Flags
    sample_age_s: Floats
    effort_ratio: Floats
    temperature_c: Floats
    voltage_v: Floats
    climate_age_s: Floats
    hardware_error: NDArray[np.uint8]
    watchdog_tripped: Flags
    lost_servo_buses: tuple[str, ...]
    lost_can_buses: tuple[str, ...]
    drives: tuple[DriveSample, ...]
    base_moving: bool
    base_powered: bool
    standstill: bool
    base_command_age_s: float | None
    supervisor_age_s: float | None
    budget_stop: str | None
    surroundings: Surroundings = NOTHING_KNOWN


@dataclass(frozen=True, slots=True, kw_only=True)
class SafetyLimits:
    """Carry the thresholds; an infinite entry switches a check off, of one joint or one sense.

    `outward_velocity` is the speed above which a joint beyond its range counts as still
    leaving it, so that the way back stays open. `position_jump` is what a joint may go beyond what
    `velocity` allows between two samples. A wheel may be off its commanded speed by
    `wheel_error_rad_s`, and by `wheel_error_ratio` of that speed on top. What is too close or out
    of the workspace counts only while it gets worse by more than `approach_m_s`: the way back
    stays open there too.
    """

    joint_names: tuple[str, ...]
    position_lower: Floats
    position_upper: Floats
    outward_velocity: Floats
    velocity: Floats
    position_jump: Floats
    following_error: Floats
    wheel_error_rad_s: float
    wheel_error_ratio: float
    servo_age_s: float
    base_command_age_s: float
    supervisor_age_s: float
    effort_ratio: Floats
    temperature_c: Floats
    voltage_min_v: Floats
    voltage_max_v: Floats
    standstill_velocity: Floats
    standstill_wheel_rad_s: float
    scan_required: bool
    scan_age_s: float
    depth_age_s: float
    pose_age_s: float
    imu_age_s: float
    keep_out_depth_m: float
    workspace_excess_m: float
    self_clearance_m: float
    environment_clearance_m: float
    approach_m_s: float
    tip_margin_ratio: float
    external_torque_nm: Floats
    tip_slow_below_ratio: float = 0.0
