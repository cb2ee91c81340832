"""Declare what is measured of control: safety, ticks, buses, joints, the base."""

from functools import partial
from typing import Final

from vla_deploy.control.state_machine import CONTROL_STATES
from vla_deploy.safety import Cause, Reaction
from vla_deploy.telemetry.metrics.metric import (
    Metric,
    count_of,
    counts_below,
    counts_between,
    is_any,
)
from vla_deploy.telemetry.metrics.paths import among, each, joints, keys, same

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
        name="vla_control_state",
        help="What control is doing about power and motion: 1 for its state, 0 for the others.",
        paths=((keys("state"),),),
        states=CONTROL_STATES,
    ),
    _status(
        name="vla_estop_latched",
        help="1 while an emergency stop waits for a person's reset.",
        paths=((keys("estop_latched"),),),
        kept=True,
    ),
    _status(
        name="vla_safety_cause",
        help="What stops or slows the robot: 1 for the cause in force, 0 for the others.",
        paths=((keys("cause"),),),
        states=tuple(cause.value for cause in Cause if cause is not Cause.NONE),
        state_label="cause",
    ),
    _status(
        name="vla_safety_reaction",
        help="What is done about it: 1 for the reaction in force, 0 for the others.",
        paths=((keys("reaction"),),),
        states=tuple(reaction.name.lower() for reaction in Reaction),
        state_label="reaction",
    ),
    _status(
        name="vla_safety_age_seconds",
        help="Age of the measurement by which the robot was judged.",
        paths=((keys("age_s"),),),
    ),
    _status(
        name="vla_safety_speed_ratio",
        help="Share of its speed that the safety rules leave the base.",
        paths=((keys("speed_ratio"),),),
        kept=True,
    ),
)

TICKS: Final[tuple[Metric, ...]] = (
    _status(
        name="vla_control_ticks_total",
        help="Ticks of control since it was started.",
        paths=((keys("tick"),),),
        kept=True,
    ),
    _status(
        name="vla_control_late_ticks_total",
        help="Ticks that began more than 1.2 periods after the last one.",
        paths=((keys("late_ticks"),),),
        kept=True,
    ),
    _status(
        name="vla_control_period_ratio",
        help="Time between the begins of two ticks, as a share of the period in force.",
        paths=((keys("period_ratio"),),),
        take=counts_between,
    ),
    _status(
        name="vla_control_period_seconds",
        help="Time between the begins of two ticks, a running mean of some 50.",
        paths=((keys("period_s"),),),
        kept=True,
    ),
    _status(
        name="vla_control_nominal_period_seconds",
        help="Time between two ticks that the profile asks for.",
        paths=((keys("nominal_period_s"),),),
    ),
    _status(
        name="vla_control_motions",
        help="Motions under way.",
        paths=((keys("active_motions"),),),
        take=count_of,
    ),
)

BUSES: Final[tuple[Metric, ...]] = (
    _status(
        name="vla_bus_cycles_total",
        help="Cycles of a servo bus since it was opened.",
        paths=((*_BUS, keys("cycles")),),
    ),
    _status(
        name="vla_bus_frames_total",
        help="Frames on a CAN bus since it was opened.",
        paths=((*_BUS, same("direction", "sent", "received")),),
    ),
    _status(
        name="vla_bus_faults_total",
        help="What went wrong on a bus since it was opened, by kind.",
        paths=((*_BUS, same("fault", *_BUS_FAULTS)),),
        kept=True,
    ),
    _status(
        name="vla_bus_answer_seconds",
        help="From the request to the whole answer of a servo bus' cycle.",
        paths=((*_BUS, keys("latency")),),
        take=counts_below,
    ),
    _status(
        name="vla_bus_answer_p99_seconds",
        help="Time that 99 % of a servo bus' cycles kept since it was opened.",
        paths=((*_BUS, keys("latency.p99_s")),),
        kept=True,
    ),
    _status(
        name="vla_bus_state",
        help="Error budget of a servo bus: 1 for its state, 0 for the others.",
        paths=((*_BUS, keys("budget.bus")),),
        states=_BUS_STATES,
    ),
    _status(
        name="vla_bus_nodes",
        help="How many servos or drives of a bus have used up their error budget, or part of it.",
        paths=(
            (*_BUS, keys("budget"), same("state", "degraded", "lost")),
            (*_BUS, among("state", {"degraded": "degraded_nodes", "lost": "lost_nodes"})),
        ),
        take=count_of,
    ),
)

JOINTS: Final[tuple[Metric, ...]] = (
    _status(
        name="vla_joint_temperature_celsius",
        help="Temperature of a joint's servo.",
        paths=((keys("joints"), joints("temperature_c")),),
        kept=True,
    ),
    _status(
        name="vla_joint_voltage_volts",
        help="Supply of a joint's servo.",
        paths=((keys("joints"), joints("voltage_v")),),
    ),
    _joint(
        name="vla_joint_effort_ratio",
        help="Current of a joint's servo as a share of its stall current, signed like the joint.",
        paths=((joints("effort_ratio"),),),
        kept=True,
    ),
    _joint(
        name="vla_joint_hardware_error",
        help="1 while a joint's servo reports a hardware error.",
        paths=((joints("error"),),),
        take=is_any,
    ),
    _joint(
        name="vla_joint_torque_enabled",
        help="1 while a joint has power.",
        paths=((joints("torque_enabled"),),),
    ),
    _joint(
        name="vla_joint_age_seconds",
        help="Age of a joint's measured position.",
        paths=((joints("age_s"),),),
    ),
    _base(
        name="vla_base_speed_meters_per_second",
        help="Speed of the base, forward.",
        paths=((keys("v_m_s"),),),
        kept=True,
    ),
    _base(
        name="vla_base_turn_radians_per_second",
        help="Turn rate of the base, counter-clockwise.",
        paths=((keys("w_rad_s"),),),
    ),
    _base(
        name="vla_base_enabled",
        help="1 while the wheel drives have power.",
        paths=((keys("enabled"),),),
    ),
)

METRICS: Final = (*SAFETY, *TICKS, *BUSES, *JOINTS)
