"""Declare what is measured of control: safety, ticks, buses, joints, the base."""

from typing import Final

from vla_deploy.control.state_machine import CONTROL_STATES
from vla_deploy.safety import Cause, Reaction
from vla_deploy.telemetry.metrics.metric import (
    Metric,
    MetricKind,
    count_of,
    counts_below,
    counts_between,
    is_any,
)
from vla_deploy.telemetry.metrics.paths import among, each, joints, keys, same

_TOPIC: Final = "control_status"
_BUS: Final = (keys("buses"), each("bus"))
_BUS_STATES: Final = ("ok", "degraded", "lost")
_BUS_FAULTS: Final = (
    *("partial_cycles", "timeouts", "crc_errors", "stuffed", "retries", "late", "suspensions"),
    *("returns", "link_lost", "dropped", "malformed", "error_frames", "arbitration_lost"),
    "not_acknowledged",
)

SAFETY: Final[tuple[Metric, ...]] = (
    Metric(
        name="vla_control_state",
        kind=MetricKind.STATES,
        help="What control is doing about power and motion: 1 for its state, 0 for the others.",
        topic=_TOPIC,
        paths=((keys("state"),),),
        states=CONTROL_STATES,
    ),
    Metric(
        name="vla_estop_latched",
        help="1 while an emergency stop waits for a person's reset.",
        topic=_TOPIC,
        paths=((keys("estop_latched"),),),
        kept=True,
    ),
    Metric(
        name="vla_safety_cause",
        kind=MetricKind.STATES,
        help="What stops or slows the robot: 1 for the cause in force, 0 for the others.",
        topic=_TOPIC,
        paths=((keys("cause"),),),
        states=tuple(cause.value for cause in Cause if cause is not Cause.NONE),
        state_label="cause",
    ),
    Metric(
        name="vla_safety_reaction",
        kind=MetricKind.STATES,
        help="What is done about it: 1 for the reaction in force, 0 for the others.",
        topic=_TOPIC,
        paths=((keys("reaction"),),),
        states=tuple(reaction.name.lower() for reaction in Reaction),
        state_label="reaction",
    ),
    Metric(
        name="vla_safety_age_seconds",
        help="Age of the measurement by which the robot was judged.",
        topic=_TOPIC,
        paths=((keys("age_s"),),),
    ),
    Metric(
        name="vla_safety_speed_ratio",
        help="Share of its speed that the safety rules leave the base.",
        topic=_TOPIC,
        paths=((keys("speed_ratio"),),),
        kept=True,
    ),
)

TICKS: Final[tuple[Metric, ...]] = (
    Metric(
        name="vla_control_ticks_total",
        kind=MetricKind.COUNTER,
        help="Ticks of control since it was started.",
        topic=_TOPIC,
        paths=((keys("tick"),),),
        kept=True,
    ),
    Metric(
        name="vla_control_late_ticks_total",
        kind=MetricKind.COUNTER,
        help="Ticks that began more than 1.2 periods after the last one.",
        topic=_TOPIC,
        paths=((keys("late_ticks"),),),
        kept=True,
    ),
    Metric(
        name="vla_control_period_ratio",
        kind=MetricKind.HISTOGRAM,
        help="Time between the begins of two ticks, as a share of the period in force.",
        topic=_TOPIC,
        paths=((keys("period_ratio"),),),
        take=counts_between,
    ),
    Metric(
        name="vla_control_period_seconds",
        help="Time between the begins of two ticks, a running mean of some 50.",
        topic=_TOPIC,
        paths=((keys("period_s"),),),
        kept=True,
    ),
    Metric(
        name="vla_control_nominal_period_seconds",
        help="Time between two ticks that the profile asks for.",
        topic=_TOPIC,
        paths=((keys("nominal_period_s"),),),
    ),
    Metric(
        name="vla_control_motions",
        help="Motions under way.",
        topic=_TOPIC,
        paths=((keys("active_motions"),),),
        take=count_of,
    ),
)

BUSES: Final[tuple[Metric, ...]] = (
    Metric(
        name="vla_bus_cycles_total",
        kind=MetricKind.COUNTER,
        help="Cycles of a servo bus since it was opened.",
        topic=_TOPIC,
        paths=((*_BUS, keys("cycles")),),
    ),
    Metric(
        name="vla_bus_frames_total",
        kind=MetricKind.COUNTER,
        help="Frames on a CAN bus since it was opened.",
        topic=_TOPIC,
        paths=((*_BUS, same("direction", "sent", "received")),),
    ),
    Metric(
        name="vla_bus_faults_total",
        kind=MetricKind.COUNTER,
        help="What went wrong on a bus since it was opened, by kind.",
        topic=_TOPIC,
        paths=((*_BUS, same("fault", *_BUS_FAULTS)),),
        kept=True,
    ),
    Metric(
        name="vla_bus_answer_seconds",
        kind=MetricKind.HISTOGRAM,
        help="From the request to the whole answer of a servo bus' cycle.",
        topic=_TOPIC,
        paths=((*_BUS, keys("latency")),),
        take=counts_below,
    ),
    Metric(
        name="vla_bus_answer_p99_seconds",
        help="Time that 99 % of a servo bus' cycles kept since it was opened.",
        topic=_TOPIC,
        paths=((*_BUS, keys("latency.p99_s")),),
        kept=True,
    ),
    Metric(
        name="vla_bus_state",
        kind=MetricKind.STATES,
        help="Error budget of a servo bus: 1 for its state, 0 for the others.",
        topic=_TOPIC,
        paths=((*_BUS, keys("budget.bus")),),
        states=_BUS_STATES,
    ),
    Metric(
        name="vla_bus_nodes",
        help="How many servos or drives of a bus have used up their error budget, or part of it.",
        topic=_TOPIC,
        paths=(
            (*_BUS, keys("budget"), same("state", "degraded", "lost")),
            (*_BUS, among("state", {"degraded": "degraded_nodes", "lost": "lost_nodes"})),
        ),
        take=count_of,
    ),
)

JOINTS: Final[tuple[Metric, ...]] = (
    Metric(
        name="vla_joint_temperature_celsius",
        help="Temperature of a joint's servo.",
        topic=_TOPIC,
        paths=((keys("joints"), joints("temperature_c")),),
        kept=True,
    ),
    Metric(
        name="vla_joint_voltage_volts",
        help="Supply of a joint's servo.",
        topic=_TOPIC,
        paths=((keys("joints"), joints("voltage_v")),),
    ),
    Metric(
        name="vla_joint_effort_ratio",
        help="Current of a joint's servo as a share of its stall current, signed like the joint.",
        topic="joint_state",
        paths=((joints("effort_ratio"),),),
        kept=True,
    ),
    Metric(
        name="vla_joint_hardware_error",
        help="1 while a joint's servo reports a hardware error.",
        topic="joint_state",
        paths=((joints("error"),),),
        take=is_any,
    ),
    Metric(
        name="vla_joint_torque_enabled",
        help="1 while a joint has power.",
        topic="joint_state",
        paths=((joints("torque_enabled"),),),
    ),
    Metric(
        name="vla_joint_age_seconds",
        help="Age of a joint's measured position.",
        topic="joint_state",
        paths=((joints("age_s"),),),
    ),
    Metric(
        name="vla_base_speed_meters_per_second",
        help="Speed of the base, forward.",
        topic="base_state",
        paths=((keys("v_m_s"),),),
        kept=True,
    ),
    Metric(
        name="vla_base_turn_radians_per_second",
        help="Turn rate of the base, counter-clockwise.",
        topic="base_state",
        paths=((keys("w_rad_s"),),),
    ),
    Metric(
        name="vla_base_enabled",
        help="1 while the wheel drives have power.",
        topic="base_state",
        paths=((keys("enabled"),),),
    ),
)

METRICS: Final = (*SAFETY, *TICKS, *BUSES, *JOINTS)
