"""Declare what is measured of control: safety, ticks, buses, joints, the base."""

from functools import partial
from typing import Final, get_args

from vla_deploy.ipc.payloads.motion import ControlStateName
from vla_deploy.safety import Cause, Reaction
from vla_deploy.telemetry.metrics.metric import (
    Metric,
    count_of,
    counts_below,
    counts_between,
    is_any,
)
from vla_deploy.telemetry.metrics.paths import among, at, each, joints, keys, path, same

_status = partial(Metric, topic="control_status")
_joint = partial(Metric, topic="joint_state")
_base = partial(Metric, topic="base_state")
_BUS: Final = (keys("buses"), each("bus"))
_BUS_STATES: Final = ("ok", "degraded", "lost")
_BUS_FAULTS: Final = (
    *("partial_cycles", "timeouts", "crc_errors", "stuffed", "retries", "late", "suspensions"),
    *("returns", "link_lost", "dropped", "malformed", "error_frames", "arbitration_lost"),
    "not_acknowledged",
)

SAFETY: Final[tuple[Metric, ...]] = (
    _status(
        "vla_control_state",
        "What control is doing about power and motion: 1 for its state, 0 for the others.",
        at("state"),
        states=get_args(ControlStateName),
    ),
    _status(
        "vla_estop_latched",
        "1 while an emergency stop waits for a person's reset.",
        at("estop_latched"),
        kept=True,
    ),
    _status(
        "vla_safety_cause",
        "What stops or slows the robot: 1 for the cause in force, 0 for the others.",
        at("cause"),
        states=tuple(cause.value for cause in Cause if cause is not Cause.NONE),
        state_label="cause",
    ),
    _status(
        "vla_safety_reaction",
        "What is done about it: 1 for the reaction in force, 0 for the others.",
        at("reaction"),
        states=tuple(reaction.name.lower() for reaction in Reaction),
        state_label="reaction",
    ),
    _status(
        "vla_safety_age_seconds",
        "Age of the measurement by which the robot was judged.",
        at("age_s"),
    ),
    _status(
        "vla_safety_speed_ratio",
        "Share of its speed that the safety rules leave the base.",
        at("speed_ratio"),
        kept=True,
    ),
)

TICKS: Final[tuple[Metric, ...]] = (
    _status(
        "vla_control_ticks_total", "Ticks of control since it was started.", at("tick"), kept=True
    ),
    _status(
        "vla_control_late_ticks_total",
        "Ticks that began more than 1.2 periods after the last one.",
        at("late_ticks"),
        kept=True,
    ),
    _status(
        "vla_control_period_ratio",
        "Time between the begins of two ticks, as a share of the period in force.",
        at("period_ratio"),
        take=counts_between,
    ),
    _status(
        "vla_control_period_seconds",
        "Time between the begins of two ticks, a running mean of some 50.",
        at("period_s"),
        kept=True,
    ),
    _status(
        "vla_control_nominal_period_seconds",
        "Time between two ticks that the profile asks for.",
        at("nominal_period_s"),
    ),
    _status("vla_control_motions", "Motions under way.", at("active_motions"), take=count_of),
)

BUSES: Final[tuple[Metric, ...]] = (
    _status(
        "vla_bus_cycles_total",
        "Cycles of a servo bus since it was opened.",
        path(*_BUS, keys("cycles")),
    ),
    _status(
        "vla_bus_frames_total",
        "Frames on a CAN bus since it was opened.",
        path(*_BUS, same("direction", "sent", "received")),
    ),
    _status(
        "vla_bus_faults_total",
        "What went wrong on a bus since it was opened, by kind.",
        path(*_BUS, same("fault", *_BUS_FAULTS)),
        kept=True,
    ),
    _status(
        "vla_bus_answer_seconds",
        "From the request to the whole answer of a servo bus' cycle.",
        path(*_BUS, keys("latency")),
        take=counts_below,
    ),
    _status(
        "vla_bus_answer_p99_seconds",
        "Time that 99 % of a servo bus' cycles kept since it was opened.",
        path(*_BUS, keys("latency.p99_s")),
        kept=True,
    ),
    _status(
        "vla_bus_state",
        "Error budget of a servo bus: 1 for its state, 0 for the others.",
        path(*_BUS, keys("budget.bus")),
        states=_BUS_STATES,
    ),
    _status(
        "vla_bus_nodes",
        "How many servos or drives of a bus have used up their error budget, or part of it.",
        (
            (*_BUS, keys("budget"), same("state", "degraded", "lost")),
            (*_BUS, among("state", {"degraded": "degraded_nodes", "lost": "lost_nodes"})),
        ),
        take=count_of,
    ),
)

JOINTS: Final[tuple[Metric, ...]] = (
    _status(
        "vla_joint_temperature_celsius",
        "Temperature of a joint's servo.",
        path(keys("joints"), joints("temperature_c")),
        kept=True,
    ),
    _status(
        "vla_joint_voltage_volts",
        "Supply of a joint's servo.",
        path(keys("joints"), joints("voltage_v")),
    ),
    _joint(
        "vla_joint_effort_ratio",
        "Current of a joint's servo as a share of its stall current, signed like the joint.",
        path(
            joints("effort_ratio"),
        ),
        kept=True,
    ),
    _joint(
        "vla_joint_hardware_error",
        "1 while a joint's servo reports a hardware error.",
        path(
            joints("error"),
        ),
        take=is_any,
    ),
    _joint(
        "vla_joint_torque_enabled",
        "1 while a joint has power.",
        path(
            joints("torque_enabled"),
        ),
    ),
    _joint(
        "vla_joint_age_seconds",
        "Age of a joint's measured position.",
        path(
            joints("age_s"),
        ),
    ),
    _base(
        "vla_base_speed_meters_per_second", "Speed of the base, forward.", at("v_m_s"), kept=True
    ),
    _base(
        "vla_base_turn_radians_per_second",
        "Turn rate of the base, counter-clockwise.",
        at("w_rad_s"),
    ),
    _base("vla_base_enabled", "1 while the wheel drives have power.", at("enabled")),
)

METRICS: Final = (*SAFETY, *TICKS, *BUSES, *JOINTS)
