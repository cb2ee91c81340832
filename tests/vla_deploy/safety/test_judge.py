"""Sweep each cause across its boundary and hold the latch, debounce and reset rules."""

import math
from collections.abc import Callable, Iterable, Iterator
from dataclasses import astuple, replace
from itertools import chain
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from vla_deploy.robots.protection import ZoneKind, ZoneSource
from vla_deploy.safety import (
    CLEAR,
    NOTHING_KNOWN,
    RULES,
    Cause,
    CauseRule,
    Clearance,
    Direction,
    DriveSample,
    Excess,
    KeepOut,
    Latch,
    Reaction,
    ResetOutcome,
    SafetyInputs,
    SafetyLimits,
    SafetyState,
    Surroundings,
    Verdict,
    ZoneFinding,
    evaluate,
)

LIMITS = SafetyLimits(
    joint_names=("shoulder", "elbow"),
    position_lower=np.array([-1.0, 0.0]),
    position_upper=np.array([1.0, 2.0]),
    outward_velocity=np.array([0.05, 0.05]),
    velocity=np.array([2.0, 3.0]),
    position_jump=np.array([0.125, np.inf]),
    following_error=np.array([0.25, np.inf]),
    wheel_error_rad_s=0.25,
    wheel_error_ratio=0.5,
    servo_age_s=0.02,
    base_command_age_s=0.25,
    supervisor_age_s=3.0,
    effort_ratio=np.array([0.5, 0.75]),
    temperature_c=np.array([75.0, 67.0]),
    voltage_min_v=np.array([9.5, 6.5]),
    voltage_max_v=np.array([15.5, 15.75]),
    standstill_velocity=np.array([0.125, 0.25]),
    standstill_wheel_rad_s=0.125,
    scan_required=True,
    scan_age_s=0.5,
    depth_age_s=0.875,
    pose_age_s=0.75,
    imu_age_s=0.25,
    keep_out_depth_m=0.0,
    workspace_excess_m=0.0,
    self_clearance_m=0.005,
    environment_clearance_m=0.01,
    approach_m_s=0.005,
    tip_margin_ratio=0.25,
    tip_slow_below_ratio=0.5,
    external_torque_nm=np.array([2.0, np.inf]),
)
LEFT = DriveSample(
    name="left_wheel",
    lost=False,
    age_s=0.0,
    age_limit_s=0.1,
    fault_code=0,
    commanded_rad_s=0.0,
    measured_rad_s=0.0,
)
SEEN = Surroundings(scan_age_s=0.0, depth_age_s=0.0, pose_age_s=0.0, imu_age_s=0.0)
HEALTHY = SafetyInputs(
    energised=True,
    estop_source=None,
    reset_requested=False,
    position=np.array([0.0, 1.0]),
    velocity=np.zeros(2),
    position_step=np.zeros(2),
    step_time_s=np.full(2, 0.004),
    setpoint=np.array([0.0, 1.0]),
    powered=np.array([True, True]),
    torque_enabled=np.array([True, True]),
    sample_age_s=np.zeros(2),
    effort_ratio=np.zeros(2),
    temperature_c=np.array([30.0, 30.0]),
    voltage_v=np.array([12.0, 12.0]),
    climate_age_s=np.array([0.1, 0.2]),
    hardware_error=np.zeros(2, dtype=np.uint8),
    watchdog_tripped=np.array([False, False]),
    lost_servo_buses=(),
    lost_can_buses=(),
    drives=(LEFT, replace(LEFT, name="right_wheel")),
    base_moving=True,
    base_powered=True,
    standstill=False,
    base_command_age_s=0.0,
    supervisor_age_s=0.0,
    budget_stop=None,
    surroundings=SEEN,
)
ULP = 1e-12
LOOSE = {
    "torque_enabled": np.array([False, True]),
    "powered": np.array([False, True]),
}


def each_plain(told: Iterable[Any]) -> list[tuple[Any, ...]]:
    """Return values as tuples, in which a measure that is not there, NaN, equals itself."""
    return [astuple(one) for one in told]


def right(**changes: Any) -> dict[str, Any]:
    return {"drives": (LEFT, replace(LEFT, name="right_wheel", **changes))}


def turning(commanded_rad_s: float, measured_rad_s: float) -> dict[str, Any]:
    return right(commanded_rad_s=commanded_rad_s, measured_rad_s=measured_rad_s)


def around(**changes: Any) -> dict[str, Any]:
    return {"around": changes}


def zone(kind: ZoneKind, name: str = "near", **changes: Any) -> ZoneFinding:
    fields: dict[str, Any] = {"sources": (ZoneSource.LIDAR,), "points": 3, "measured": 0.4}
    fields |= {"limit": 0.5, "speed_ratio": 0.5, "blocked": ()}
    return ZoneFinding(kind=kind, name=name, **fields | changes)


def excess(excess_m: float, rate_m_s: float) -> dict[str, Any]:
    return around(workspace=Excess(subject="left hand", excess_m=excess_m, rate_m_s=rate_m_s))


def close_by(
    which: str, distance_m: float, closing_m_s: float, least_m: float = np.inf
) -> dict[str, Any]:
    pair = Clearance(
        first="hand",
        second="head",
        distance_m=distance_m,
        closing_m_s=closing_m_s,
        least_m=least_m,
    )
    return around(**{which: pair})


def stepped(step: float, time_s: float = 0.25, **changes: Any) -> dict[str, Any]:
    steps = {"position_step": np.array([step, 9.0]), "step_time_s": np.array([time_s, 0.0])}
    return steps | changes


def within(depth_m: float) -> dict[str, Any]:
    area = KeepOut(name="pet corner", depth_m=depth_m, blocked=(Direction.FORWARD,))
    return around(keep_out=area)


def pushed(shoulder_nm: float, elbow_nm: float = 99.0, **changes: Any) -> dict[str, Any]:
    return around(external_torque_nm=np.array([shoulder_nm, elbow_nm])) | changes


def standing(**changes: Any) -> dict[str, Any]:
    return {"standstill": True, **changes}


def let_go(*joints: bool, powered: tuple[bool, bool]) -> dict[str, Any]:
    return {"torque_enabled": ~np.array(joints), "powered": np.array(powered)}


def at(position: float, velocity: float) -> dict[str, Any]:
    return {
        "position": np.array([position, 1.0]),
        "setpoint": np.array([position, 1.0]),
        "velocity": np.array([velocity, 0.0]),
    }


# cause, what spoils a healthy tick just enough, what is just not enough, subject
BOUNDARIES: tuple[tuple[Cause, dict[str, Any], dict[str, Any], str], ...] = (
    (Cause.ESTOP, {"estop_source": "button"}, {"estop_source": None}, "button"),
    (Cause.SERVO_BUS_LOST, {"lost_servo_buses": ("servos",)}, {"lost_servo_buses": ()}, "servos"),
    (
        Cause.SERVO_BUS_LOST,
        {"sample_age_s": np.array([0.0, 0.02 + ULP])},
        {"sample_age_s": np.array([0.0, 0.02])},
        "elbow",
    ),
    (
        Cause.SERVO_BUS_LOST,
        {"sample_age_s": np.array([0.03, 0.02 + ULP])},
        {"sample_age_s": np.array([0.02, 0.02])},
        "every servo",
    ),
    (
        Cause.SERVO_BUS_LOST,
        {"sample_age_s": np.array([0.03, 0.02])},
        {"sample_age_s": np.array([0.02, 0.0])},
        "shoulder",
    ),
    (Cause.CAN_BUS_LOST, {"lost_can_buses": ("can0",)}, {"lost_can_buses": ()}, "can0"),
    (Cause.CAN_BUS_LOST, right(lost=True), right(age_s=9.0), "right_wheel"),
    (
        Cause.SERVO_HARDWARE_ERROR,
        {"hardware_error": np.array([0, 32], dtype=np.uint8)},
        {"hardware_error": np.array([0, 0], dtype=np.uint8)},
        "elbow",
    ),
    (Cause.DRIVE_FAULT, right(fault_code=1), right(fault_code=0), "right_wheel"),
    (
        Cause.SERVO_WATCHDOG_TRIPPED,
        {"watchdog_tripped": np.array([False, True])},
        {"watchdog_tripped": np.array([False, False])},
        "elbow",
    ),
    (
        Cause.JOINT_UNPOWERED,
        let_go(False, True, powered=(True, True)),
        let_go(False, True, powered=(True, False)),
        "elbow",
    ),
    (
        Cause.JOINT_UNPOWERED,
        let_go(True, True, powered=(True, False)),
        let_go(True, True, powered=(False, False)),
        "shoulder",
    ),
    (Cause.ENCODER_JUMP, stepped(0.625 + ULP), stepped(0.625), "shoulder"),
    (Cause.ENCODER_JUMP, stepped(-0.625 - ULP), stepped(-0.625), "shoulder"),
    (Cause.ENCODER_JUMP, stepped(0.125 + ULP, 0.0), stepped(0.125, 0.0), "shoulder"),
    (
        Cause.ENCODER_JUMP,
        stepped(3.0),
        stepped(3.0, **LOOSE),
        "shoulder",
    ),
    (Cause.JOINT_POSITION_LIMIT, at(1.0 + ULP, 0.06), at(1.0, 0.06), "shoulder"),
    (Cause.JOINT_POSITION_LIMIT, at(1.1, 0.05 + ULP), at(1.1, 0.05), "shoulder"),
    (Cause.JOINT_POSITION_LIMIT, at(-1.0 - ULP, -0.06), at(-1.0, -0.06), "shoulder"),
    (Cause.JOINT_POSITION_LIMIT, at(-1.1, -0.05 - ULP), at(-1.1, -0.05), "shoulder"),
    (Cause.JOINT_POSITION_LIMIT, at(1.1, 0.06), at(1.1, -1.0), "shoulder"),
    (Cause.JOINT_VELOCITY_LIMIT, at(0.0, 2.0 + ULP), at(0.0, 2.0), "shoulder"),
    (Cause.JOINT_VELOCITY_LIMIT, at(0.0, -2.0 - ULP), at(0.0, -2.0), "shoulder"),
    (
        Cause.FOLLOWING_ERROR,
        {"setpoint": np.array([0.25 + ULP, 1.0])},
        {"setpoint": np.array([0.25, 1.0])},
        "shoulder",
    ),
    (
        Cause.FOLLOWING_ERROR,
        {"position": np.array([0.5, 1.0]), "setpoint": np.array([0.25 - ULP, 1.0])},
        {"position": np.array([0.5, 1.0]), "setpoint": np.array([0.25, 1.0])},
        "shoulder",
    ),
    (
        Cause.FOLLOWING_ERROR,
        {"setpoint": np.array([-0.25 - ULP, 1.0])},
        {"setpoint": np.array([0.0, 9.0])},
        "shoulder",
    ),
    (Cause.WHEEL_FOLLOWING_ERROR, turning(0.0, 0.25 + ULP), turning(0.0, 0.25), "right_wheel"),
    (Cause.WHEEL_FOLLOWING_ERROR, turning(0.0, -0.25 - ULP), turning(0.0, -0.25), "right_wheel"),
    (Cause.WHEEL_FOLLOWING_ERROR, turning(2.0, 0.75 - ULP), turning(2.0, 0.75), "right_wheel"),
    (Cause.WHEEL_FOLLOWING_ERROR, turning(2.0, 3.25 + ULP), turning(2.0, 3.25), "right_wheel"),
    (Cause.WHEEL_FOLLOWING_ERROR, turning(-2.0, -0.75 + ULP), turning(-2.0, -0.75), "right_wheel"),
    (Cause.WHEEL_FOLLOWING_ERROR, turning(2.0, -2.0), turning(2.0, 2.0), "right_wheel"),
    (
        Cause.SUPERVISOR_LOST,
        {"supervisor_age_s": 3.0 + ULP},
        {"supervisor_age_s": 3.0},
        "supervisor",
    ),
    (Cause.SUPERVISOR_LOST, {"supervisor_age_s": 9.0}, {"supervisor_age_s": None}, "supervisor"),
    (
        Cause.STALE_COMMAND,
        {"base_command_age_s": 0.25 + ULP},
        {"base_command_age_s": 0.25},
        "base_command",
    ),
    (
        Cause.STALE_COMMAND,
        {"base_command_age_s": 9.0},
        {"base_command_age_s": 9.0, "base_moving": False},
        "base_command",
    ),
    (
        Cause.STANDSTILL_MOTION,
        standing(velocity=np.array([0.125 + ULP, 0.25])),
        standing(velocity=np.array([0.125, 0.25])),
        "shoulder",
    ),
    (
        Cause.STANDSTILL_MOTION,
        standing(velocity=np.array([0.0, -0.25 - ULP])),
        {"velocity": np.array([0.0, -0.25 - ULP])},
        "elbow",
    ),
    (
        Cause.STANDSTILL_MOTION,
        standing(**turning(0.0, -0.125 - ULP)),
        standing(**turning(0.0, -0.125)),
        "right_wheel",
    ),
    (
        Cause.STANDSTILL_MOTION,
        standing(**turning(0.0, 0.2)),
        standing(**turning(0.0, 0.2), base_powered=False),
        "right_wheel",
    ),
    (
        Cause.JOINT_CURRENT_LIMIT,
        {"effort_ratio": np.array([-0.5 - ULP, 0.75])},
        {"effort_ratio": np.array([-0.5, 0.75])},
        "shoulder",
    ),
    (
        Cause.JOINT_CURRENT_LIMIT,
        {"effort_ratio": np.array([0.5, 0.75 + ULP])},
        {"effort_ratio": np.array([0.9, 0.75]), **LOOSE},
        "elbow",
    ),
    (
        Cause.JOINT_TEMPERATURE_LIMIT,
        {"temperature_c": np.array([75.0, 67.0 + ULP * 100])},
        {"temperature_c": np.array([75.0, 67.0])},
        "elbow",
    ),
    (
        Cause.JOINT_TEMPERATURE_LIMIT,
        {"temperature_c": np.array([80.0, np.nan])},
        {"temperature_c": np.array([np.nan, np.nan])},
        "shoulder",
    ),
    (
        Cause.JOINT_VOLTAGE_LIMIT,
        {"voltage_v": np.array([9.5 - ULP * 10, 12.0])},
        {"voltage_v": np.array([9.5, 6.5])},
        "shoulder",
    ),
    (
        Cause.JOINT_VOLTAGE_LIMIT,
        {"voltage_v": np.array([15.5, 15.75 + ULP * 10])},
        {"voltage_v": np.array([15.5, 15.75])},
        "elbow",
    ),
    (
        Cause.JOINT_VOLTAGE_LIMIT,
        {"voltage_v": np.array([np.nan, 0.0])},
        {"voltage_v": np.array([np.nan, np.nan])},
        "elbow",
    ),
    (Cause.BUDGET_EXHAUSTED, {"budget_stop": "memory"}, {"budget_stop": None}, "memory"),
    (Cause.COLLISION, pushed(-2.0 - ULP), pushed(-2.0), "shoulder"),
    (
        Cause.COLLISION,
        pushed(2.0 + ULP),
        pushed(2.5, **LOOSE),
        "shoulder",
    ),
    (
        Cause.SELF_COLLISION,
        close_by("self_clearance", 0.005 - ULP, 0.006),
        close_by("self_clearance", 0.005, 0.006),
        "hand and head",
    ),
    (
        Cause.SELF_COLLISION,
        close_by("self_clearance", 0.004, 0.005 + ULP),
        close_by("self_clearance", 0.004, 0.005),
        "hand and head",
    ),
    (
        Cause.SELF_COLLISION,
        close_by("self_clearance", -0.002 - ULP, 0.006, least_m=-0.002),
        close_by("self_clearance", -0.002, 0.006, least_m=-0.002),
        "hand and head",
    ),
    (
        Cause.ENVIRONMENT_COLLISION,
        close_by("environment_clearance", 0.01 - ULP, 0.006),
        close_by("environment_clearance", 0.01, 0.006),
        "hand and head",
    ),
    (
        Cause.ENVIRONMENT_COLLISION,
        close_by("environment_clearance", -0.002, 0.005 + ULP),
        close_by("environment_clearance", -0.002, 0.005),
        "hand and head",
    ),
    (Cause.WORKSPACE, excess(ULP, 0.006), excess(0.0, 0.006), "left hand"),
    (Cause.WORKSPACE, excess(0.1, 0.005 + ULP), excess(0.1, 0.005), "left hand"),
    (
        Cause.TIP_OVER,
        around(tip_margin_ratio=0.25 - ULP),
        around(tip_margin_ratio=0.25),
        "balance",
    ),
    (
        Cause.TIP_MARGIN,
        around(tip_margin_ratio=0.5 - ULP),
        around(tip_margin_ratio=0.5),
        "balance",
    ),
    (Cause.STALE_SCAN, around(scan_age_s=0.5 + ULP), around(scan_age_s=0.5), "scan"),
    (
        Cause.STALE_SCAN,
        around(scan_age_s=None),
        around(scan_age_s=None) | {"base_moving": False},
        "scan",
    ),
    (
        Cause.STALE_DEPTH,
        around(depth_age_s=0.875 + ULP),
        around(depth_age_s=0.875),
        "near_obstacles",
    ),
    (
        Cause.STALE_DEPTH,
        around(depth_age_s=1.5 + ULP, depth_due_s=1.5),
        around(depth_age_s=1.5, depth_due_s=1.5),
        "near_obstacles",
    ),
    (Cause.STALE_POSE, around(pose_age_s=0.75 + ULP), around(pose_age_s=0.75), "pose"),
    (Cause.STALE_IMU, around(imu_age_s=0.25 + ULP), around(imu_age_s=0.25), "imu"),
    (Cause.KEEP_OUT_ZONE, within(ULP), within(0.0), "pet corner"),
    (
        Cause.OBSTACLE_STOP_ZONE,
        around(zones=(zone(ZoneKind.STOP, blocked=(Direction.FORWARD,)),)),
        around(zones=()),
        "near",
    ),
    (Cause.OBSTACLE_SLOW_ZONE, around(zones=(zone(ZoneKind.SLOW),)), around(zones=()), "near"),
    (Cause.OBSTACLE_LIMIT_ZONE, around(zones=(zone(ZoneKind.LIMIT),)), around(zones=()), "near"),
    (Cause.OBSTACLE_APPROACH, around(zones=(zone(ZoneKind.APPROACH),)), around(zones=()), "near"),
)
# cause, what gives a measured value, the limit, and on which side of it the cause lies
SWEEPS: tuple[tuple[Cause, Callable[[float], dict[str, Any]], float, int], ...] = (
    (Cause.SERVO_BUS_LOST, lambda age_s: {"sample_age_s": np.array([0.0, age_s])}, 0.02, 1),
    (Cause.ENCODER_JUMP, lambda step: stepped(step), 0.625, 1),
    (Cause.ENCODER_JUMP, lambda step: stepped(step), -0.625, -1),
    (Cause.JOINT_POSITION_LIMIT, lambda position: at(position, 0.5), 1.0, 1),
    (Cause.JOINT_POSITION_LIMIT, lambda position: at(position, -0.5), -1.0, -1),
    (Cause.JOINT_POSITION_LIMIT, lambda velocity: at(1.5, velocity), 0.05, 1),
    (Cause.JOINT_POSITION_LIMIT, lambda velocity: at(-1.5, velocity), -0.05, -1),
    (Cause.JOINT_VELOCITY_LIMIT, lambda velocity: at(0.0, velocity), 2.0, 1),
    (Cause.JOINT_VELOCITY_LIMIT, lambda velocity: at(0.0, velocity), -2.0, -1),
    (Cause.FOLLOWING_ERROR, lambda setpoint: {"setpoint": np.array([setpoint, 1.0])}, 0.25, 1),
    (Cause.FOLLOWING_ERROR, lambda setpoint: {"setpoint": np.array([setpoint, 1.0])}, -0.25, -1),
    (Cause.WHEEL_FOLLOWING_ERROR, lambda speed: turning(2.0, speed), 3.25, 1),
    (Cause.WHEEL_FOLLOWING_ERROR, lambda speed: turning(2.0, speed), 0.75, -1),
    (Cause.JOINT_CURRENT_LIMIT, lambda ratio: {"effort_ratio": np.array([ratio, 0.0])}, 0.5, 1),
    (Cause.JOINT_CURRENT_LIMIT, lambda ratio: {"effort_ratio": np.array([ratio, 0.0])}, -0.5, -1),
    (Cause.JOINT_TEMPERATURE_LIMIT, lambda t: {"temperature_c": np.array([t, 30.0])}, 75.0, 1),
    (Cause.JOINT_VOLTAGE_LIMIT, lambda volts: {"voltage_v": np.array([volts, 12.0])}, 15.5, 1),
    (Cause.JOINT_VOLTAGE_LIMIT, lambda volts: {"voltage_v": np.array([volts, 12.0])}, 9.5, -1),
    (Cause.STANDSTILL_MOTION, lambda v: standing(velocity=np.array([v, 0.0])), 0.125, 1),
    (Cause.STANDSTILL_MOTION, lambda v: standing(velocity=np.array([v, 0.0])), -0.125, -1),
    (Cause.STANDSTILL_MOTION, lambda speed: standing(**turning(0.0, speed)), 0.125, 1),
    (Cause.SUPERVISOR_LOST, lambda age_s: {"supervisor_age_s": age_s}, 3.0, 1),
    (Cause.STALE_COMMAND, lambda age_s: {"base_command_age_s": age_s}, 0.25, 1),
    (Cause.STALE_SCAN, lambda age_s: around(scan_age_s=age_s), 0.5, 1),
    (Cause.STALE_DEPTH, lambda age_s: around(depth_age_s=age_s), 0.875, 1),
    (Cause.STALE_DEPTH, lambda age_s: around(depth_age_s=age_s, depth_due_s=1.5), 1.5, 1),
    (Cause.STALE_POSE, lambda age_s: around(pose_age_s=age_s), 0.75, 1),
    (Cause.STALE_IMU, lambda age_s: around(imu_age_s=age_s), 0.25, 1),
    (Cause.COLLISION, lambda torque_nm: pushed(torque_nm), 2.0, 1),
    (Cause.COLLISION, lambda torque_nm: pushed(torque_nm), -2.0, -1),
    (Cause.SELF_COLLISION, lambda gap_m: close_by("self_clearance", gap_m, 0.1), 0.005, -1),
    (Cause.SELF_COLLISION, lambda rate: close_by("self_clearance", 0.0, rate), 0.005, 1),
    (
        Cause.ENVIRONMENT_COLLISION,
        lambda gap_m: close_by("environment_clearance", gap_m, 0.1),
        0.01,
        -1,
    ),
    (
        Cause.ENVIRONMENT_COLLISION,
        lambda rate: close_by("environment_clearance", 0.0, rate),
        0.005,
        1,
    ),
    (Cause.WORKSPACE, lambda excess_m: excess(excess_m, 0.1), 0.0, 1),
    (Cause.WORKSPACE, lambda rate: excess(0.1, rate), 0.005, 1),
    (Cause.TIP_OVER, lambda margin: around(tip_margin_ratio=margin), 0.25, -1),
    (Cause.TIP_MARGIN, lambda margin: around(tip_margin_ratio=margin), 0.5, -1),
    (Cause.KEEP_OUT_ZONE, lambda depth_m: within(depth_m), 0.0, 1),
)
# Causes that no number decides: somebody says so, or nobody does.
SAID = {
    Cause.ESTOP,
    Cause.CAN_BUS_LOST,
    Cause.SERVO_HARDWARE_ERROR,
    Cause.DRIVE_FAULT,
    Cause.SERVO_WATCHDOG_TRIPPED,
    Cause.JOINT_UNPOWERED,
    Cause.BUDGET_EXHAUSTED,
    Cause.OBSTACLE_STOP_ZONE,
    Cause.OBSTACLE_SLOW_ZONE,
    Cause.OBSTACLE_LIMIT_ZONE,
    Cause.OBSTACLE_APPROACH,
}
BY_CAUSE = {rule.cause: rule for rule in RULES}
SPOILERS = {cause: changes for cause, changes, _, _ in reversed(BOUNDARIES)}
cases = pytest.mark.parametrize(("cause", "bad", "good", "subject"), BOUNDARIES)
rules = pytest.mark.parametrize("rule", RULES, ids=[rule.cause.value for rule in RULES])


def inputs_with(changes: dict[str, Any]) -> SafetyInputs:
    own = {name: value for name, value in changes.items() if name != "around"}
    surroundings = replace(SEEN, **changes.get("around", {}))
    return replace(HEALTHY, **own, surroundings=surroundings)


def tick(state: SafetyState, **changes: Any) -> tuple[SafetyState, Verdict]:
    return evaluate(state, inputs_with(changes), LIMITS)


def ticks(state: SafetyState, count: int, **changes: Any) -> tuple[SafetyState, Verdict]:
    verdict = CLEAR
    for _ in range(count):
        state, verdict = tick(state, **changes)
    return state, verdict


def test_a_healthy_tick_gives_the_clear_verdict_and_keeps_the_state() -> None:
    state = SafetyState()
    after, verdict = tick(state)
    assert after is state
    assert verdict is CLEAR
    assert verdict.text == ""


def test_every_cause_has_exactly_one_row_and_a_boundary_case() -> None:
    assert [rule.cause for rule in RULES] == [c for c in Cause if c is not Cause.NONE]
    assert {case[0] for case in BOUNDARIES} == set(BY_CAUSE)


@cases
def test_a_cause_is_found_just_beyond_its_limit(
    cause: Cause, bad: dict[str, Any], good: dict[str, Any], subject: str
) -> None:
    rule = BY_CAUSE[cause]
    _, verdict = ticks(SafetyState(), rule.debounce_samples, **bad)
    assert (verdict.cause, verdict.reaction) == (cause, rule.reaction)
    assert verdict.subject == subject
    assert verdict.text.startswith(f"{cause.value} ({subject})")
    assert verdict.text.endswith(rule.advice)


# What has slowed the base before this cause stops it.
BEFORE = {Cause.TIP_OVER: Cause.TIP_MARGIN}


@cases
def test_a_cause_is_not_found_at_its_limit(
    cause: Cause, bad: dict[str, Any], good: dict[str, Any], subject: str
) -> None:
    _, verdict = ticks(SafetyState(), BY_CAUSE[cause].debounce_samples, **good)
    assert verdict.cause is BEFORE.get(cause, Cause.NONE)
    assert verdict is CLEAR or cause in BEFORE


def test_every_cause_that_a_number_decides_is_swept() -> None:
    assert {sweep[0] for sweep in SWEEPS} | SAID == set(BY_CAUSE)
    assert not {sweep[0] for sweep in SWEEPS} & SAID


@pytest.mark.parametrize(("cause", "changes", "limit", "side"), SWEEPS)
def test_a_cause_begins_exactly_beyond_its_limit(
    cause: Cause, changes: Callable[[float], dict[str, Any]], limit: float, side: int
) -> None:
    found = [
        ticks(SafetyState(), BY_CAUSE[cause].debounce_samples, **changes(value))[1].cause is cause
        for value in (limit - side * 1e-3, limit - side * 1e-9, limit, limit + side * 1e-9)
    ]
    assert found == [False, False, False, True]


@rules
def test_a_cause_acts_only_after_its_debounce(rule: CauseRule) -> None:
    state, verdict = ticks(SafetyState(), rule.debounce_samples - 1, **SPOILERS[rule.cause])
    assert verdict.cause is BEFORE.get(rule.cause, Cause.NONE)
    _, verdict = tick(state, **SPOILERS[rule.cause])
    assert verdict.reaction is rule.reaction


@pytest.mark.parametrize("rule", [rule for rule in RULES if rule.debounce_samples > 1])
def test_one_good_sample_starts_the_debounce_again(rule: CauseRule) -> None:
    state, _ = ticks(SafetyState(), rule.debounce_samples - 1, **SPOILERS[rule.cause])
    state, _ = tick(state)
    _, verdict = ticks(state, rule.debounce_samples - 1, **SPOILERS[rule.cause])
    assert verdict.cause is BEFORE.get(rule.cause, Cause.NONE)


@rules
def test_a_latched_cause_outlives_itself_until_reset(rule: CauseRule) -> None:
    state, _ = ticks(SafetyState(), rule.debounce_samples, **SPOILERS[rule.cause])
    state, verdict = ticks(state, max(100, rule.release_samples))
    latches = rule.latch is not Latch.NEVER
    assert verdict.cause is (rule.cause if latches else Cause.NONE)
    assert verdict.latched is latches
    state, verdict = tick(state, reset_requested=True)
    assert astuple(verdict) == astuple(replace(CLEAR, reset=ResetOutcome.DONE))
    assert state == SafetyState()


@rules
def test_reset_is_refused_while_a_latched_cause_persists(rule: CauseRule) -> None:
    state, _ = ticks(SafetyState(), rule.debounce_samples, **SPOILERS[rule.cause])
    after, verdict = tick(state, reset_requested=True, **SPOILERS[rule.cause])
    assert verdict.reaction is rule.reaction
    refused = rule.latch is not Latch.NEVER
    assert verdict.reset is (ResetOutcome.REFUSED if refused else ResetOutcome.DONE)
    assert after.latched == state.latched


@rules
def test_only_the_estop_latches_while_nothing_is_energised(rule: CauseRule) -> None:
    changes = {**SPOILERS[rule.cause], "energised": False}
    state, _ = ticks(SafetyState(), rule.debounce_samples, **changes)
    assert bool(state.latched) is (rule.cause is Cause.ESTOP)
    assert state.estop_latched is (rule.cause is Cause.ESTOP)


def test_what_latches_waits_for_the_operator_and_the_rest_does_not() -> None:
    automatic = {rule.cause for rule in RULES if rule.latch is Latch.NEVER}
    assert automatic == {
        rule.cause
        for rule in RULES
        if rule.reaction in range(Reaction.BASE_SLOW, Reaction.PROTECTIVE_STOP + 1)
    }
    assert {rule.cause for rule in RULES if rule.latch is Latch.ALWAYS} == {Cause.ESTOP}


automatic_rules = pytest.mark.parametrize(
    "rule",
    [rule for rule in RULES if rule.release_samples > 0],
    ids=lambda rule: rule.cause.value,
)


@automatic_rules
def test_what_ends_by_itself_ends_when_it_was_gone_for_its_time(rule: CauseRule) -> None:
    state, _ = ticks(SafetyState(), rule.debounce_samples, **SPOILERS[rule.cause])
    state, verdict = ticks(state, rule.release_samples - 1)
    assert (verdict.cause, verdict.latched) == (rule.cause, False)
    state, verdict = tick(state)
    assert astuple(verdict) == astuple(CLEAR)
    assert state == SafetyState()


@automatic_rules
def test_a_cause_that_comes_back_starts_its_release_again(rule: CauseRule) -> None:
    state, _ = ticks(SafetyState(), rule.debounce_samples, **SPOILERS[rule.cause])
    state, _ = ticks(state, rule.release_samples - 1)
    state, _ = ticks(state, rule.debounce_samples, **SPOILERS[rule.cause])
    state, verdict = ticks(state, rule.release_samples - 1)
    assert verdict.cause is rule.cause


def test_a_flickering_cause_does_not_run_its_release_down() -> None:
    state, _ = ticks(SafetyState(), 25, **SPOILERS[Cause.JOINT_VOLTAGE_LIMIT])
    for _ in range(20):
        state, _ = tick(state, **SPOILERS[Cause.JOINT_VOLTAGE_LIMIT])
        state, verdict = tick(state)
        assert verdict.cause is Cause.JOINT_VOLTAGE_LIMIT
    left = [one.left for one in state.lingering]
    assert left == [499]


def test_a_flicker_below_the_debounce_starts_the_release_again() -> None:
    state, _ = ticks(SafetyState(), 25, **SPOILERS[Cause.JOINT_VOLTAGE_LIMIT])
    state, _ = ticks(state, 10)
    assert [one.left for one in state.lingering] == [490]
    state, _ = ticks(state, 24, **SPOILERS[Cause.JOINT_VOLTAGE_LIMIT])
    assert [one.left for one in state.lingering] == [500]


def test_a_reset_does_not_end_what_ends_by_itself() -> None:
    state, _ = tick(SafetyState(), budget_stop="memory")
    _, verdict = tick(state, reset_requested=True)
    assert (verdict.cause, verdict.reset) == (Cause.BUDGET_EXHAUSTED, ResetOutcome.DONE)


@rules
def test_what_brings_the_base_to_rest_leaves_it_no_speed(rule: CauseRule) -> None:
    _, verdict = ticks(SafetyState(), rule.debounce_samples, **SPOILERS[rule.cause])
    assert (verdict.speed_ratio == 0.0) is (rule.reaction >= Reaction.BASE_RAMP)


def test_zones_of_one_kind_leave_the_least_speed_and_name_the_nearest() -> None:
    far = zone(ZoneKind.SLOW, "far", measured=0.9, limit=1.2, speed_ratio=0.2)
    near = zone(ZoneKind.SLOW, "near", measured=0.3, limit=0.6, speed_ratio=0.6)
    _, verdict = tick(SafetyState(), **around(zones=(far, near), scan_age_s=0.2))
    assert (verdict.subject, verdict.measured, verdict.limit) == ("near", 0.3, 0.6)
    assert verdict.speed_ratio == 0.2


@pytest.mark.parametrize(
    ("sources", "scan_age_s", "depth_age_s", "age_s"),
    [
        ((ZoneSource.LIDAR,), 0.1, 0.2, 0.1),
        ((ZoneSource.DEPTH,), 0.1, 0.2, 0.2),
        ((ZoneSource.LIDAR, ZoneSource.DEPTH), 0.1, 0.2, 0.2),
        ((ZoneSource.LIDAR, ZoneSource.DEPTH), 0.3, 0.2, 0.3),
        ((ZoneSource.DEPTH,), 0.1, None, np.inf),
    ],
)
def test_a_zone_tells_the_age_of_the_oldest_that_it_is_judged_by(
    sources: tuple[ZoneSource, ...],
    scan_age_s: float | None,
    depth_age_s: float | None,
    age_s: float,
) -> None:
    ages = {"scan_age_s": scan_age_s, "depth_age_s": depth_age_s}
    changes = around(zones=(zone(ZoneKind.SLOW, sources=sources),), **ages)
    assert tick(SafetyState(), **changes | {"base_moving": False})[1].age_s == age_s


def test_every_active_zone_bounds_the_base_whichever_is_named() -> None:
    ahead = zone(ZoneKind.STOP, blocked=(Direction.FORWARD,), speed_ratio=1.0)
    beside = zone(ZoneKind.STOP, blocked=(Direction.TURN_LEFT,), speed_ratio=1.0)
    slow = zone(ZoneKind.SLOW, speed_ratio=0.3)
    _, verdict = tick(SafetyState(), **around(zones=(slow, ahead, beside)))
    assert verdict.cause is Cause.OBSTACLE_STOP_ZONE
    assert verdict.speed_ratio == 0.3
    assert verdict.blocked == {Direction.FORWARD, Direction.TURN_LEFT}


def test_the_way_out_of_a_keep_out_area_stays_open() -> None:
    _, verdict = ticks(SafetyState(), 2, **within(0.1))
    assert verdict.blocked == {Direction.FORWARD}
    assert verdict.speed_ratio == 1.0


def test_a_robot_without_a_lidar_may_drive() -> None:
    blind = inputs_with(around(scan_age_s=None))
    _, verdict = evaluate(SafetyState(), blind, replace(LIMITS, scan_required=False))
    assert verdict is CLEAR


@pytest.mark.parametrize("name", ["depth_age_s", "pose_age_s", "imu_age_s"])
def test_a_robot_that_is_judged_by_no_such_sense_may_drive(name: str) -> None:
    limits = replace(LIMITS, **{name: np.inf})
    for age_s in (9.0, None):
        blind = inputs_with(around(**{name: age_s}))
        assert evaluate(SafetyState(), blind, limits)[1] is CLEAR


SENSES = {
    "scan_age_s": (Cause.STALE_SCAN, "scan", 0.5),
    "depth_age_s": (Cause.STALE_DEPTH, "near_obstacles", 0.875),
    "pose_age_s": (Cause.STALE_POSE, "pose", 0.75),
    "imu_age_s": (Cause.STALE_IMU, "imu", 0.25),
}


@pytest.mark.parametrize("name", SENSES)
def test_a_sense_that_never_told_anything_is_infinitely_old(name: str) -> None:
    _, verdict = tick(SafetyState(), **around(**{name: None}))
    assert (verdict.cause, verdict.subject, verdict.limit) == SENSES[name]
    assert verdict.measured == verdict.age_s == np.inf


@pytest.mark.parametrize("name", SENSES)
@pytest.mark.parametrize("age_s", [9.0, None])
def test_a_base_that_stands_may_be_without_any_sense(name: str, age_s: float | None) -> None:
    standing_still = around(**{name: age_s}) | {"base_moving": False}
    assert tick(SafetyState(), **standing_still)[1] is CLEAR


def test_a_silent_perception_is_told_by_its_scan() -> None:
    never = dict.fromkeys(SENSES)
    _, verdict = tick(SafetyState(), **around(**never))
    assert verdict.cause is Cause.STALE_SCAN


def test_nothing_known_of_the_surroundings_forbids_nothing_but_driving_blind() -> None:
    nothing = replace(HEALTHY, surroundings=NOTHING_KNOWN)
    assert evaluate(SafetyState(), nothing, LIMITS)[1].cause is Cause.STALE_SCAN
    standing_still = replace(nothing, base_moving=False)
    assert evaluate(SafetyState(), standing_still, LIMITS)[1] is CLEAR


@pytest.mark.parametrize(
    "cause", [Cause.SELF_COLLISION, Cause.ENVIRONMENT_COLLISION, Cause.WORKSPACE]
)
def test_a_disarmed_arm_may_be_moved_by_hand_wherever_it_goes(cause: Cause) -> None:
    assert ticks(SafetyState(), 5, **SPOILERS[cause], energised=False)[1] is CLEAR
    limp = let_go(False, True, powered=(True, False))
    assert ticks(SafetyState(), 5, **SPOILERS[cause], **limp)[1] is CLEAR


@pytest.mark.parametrize(
    "cause", [Cause.SELF_COLLISION, Cause.ENVIRONMENT_COLLISION, Cause.WORKSPACE]
)
def test_a_joint_that_lets_go_hides_nothing_of_what_the_others_do(cause: Cause) -> None:
    loose = let_go(False, True, powered=(True, True))
    state, verdict = ticks(SafetyState(), 2, **SPOILERS[cause], **loose)
    assert verdict.cause is cause
    _, verdict = tick(state, **SPOILERS[cause], **loose)
    assert verdict.cause is Cause.JOINT_UNPOWERED


def test_a_loose_joint_may_move_during_standstill() -> None:
    loose = {**LOOSE, "velocity": np.array([9.0, 0.0])}
    assert ticks(SafetyState(), 100, **standing(**loose))[1] is CLEAR


def test_a_speed_that_nobody_measures_any_more_is_no_motion_at_standstill() -> None:
    fast = standing(velocity=np.array([9.0, 0.0]))
    assert ticks(SafetyState(), 100, **fast)[1].cause is Cause.STANDSTILL_MOTION
    old = {**fast, "sample_age_s": np.array([5.0, 5.0])}
    assert ticks(SafetyState(), 100, **old)[1].cause is not Cause.STANDSTILL_MOTION


@pytest.mark.parametrize("cause", [Cause.JOINT_POSITION_LIMIT, Cause.JOINT_VELOCITY_LIMIT])
def test_a_joint_without_torque_has_no_limits(cause: Cause) -> None:
    _, verdict = ticks(SafetyState(), 60, **SPOILERS[cause], **LOOSE)
    assert verdict is CLEAR


def test_a_joint_without_torque_has_no_following_error() -> None:
    changes = SPOILERS[Cause.FOLLOWING_ERROR] | LOOSE
    assert ticks(SafetyState(), 60, **changes)[1] is CLEAR


def test_the_numbers_of_a_finding_reach_its_text() -> None:
    _, verdict = ticks(SafetyState(), 2, **at(1.25, 0.5))
    assert (verdict.measured, verdict.limit) == (1.25, 1.0)
    assert "1.25, limit 1;" in verdict.text
    _, verdict = ticks(SafetyState(), 2, **at(-1.5, -0.5))
    assert (verdict.measured, verdict.limit) == (-1.5, -1.0)


@pytest.mark.parametrize(("volts", "limit_v"), [(9.0, 9.5), (16.0, 15.5)])
def test_a_voltage_is_measured_against_the_limit_that_it_is_beyond(
    volts: float, limit_v: float
) -> None:
    _, verdict = ticks(SafetyState(), 25, voltage_v=np.array([volts, 12.0]))
    assert (verdict.measured, verdict.limit) == (volts, limit_v)


@pytest.mark.parametrize(
    ("changes", "age_s"),
    [
        ({"sample_age_s": np.array([0.5, 0.0])}, 0.5),
        (right(lost=True, age_s=0.75), 0.75),
        ({"base_command_age_s": 1.5}, 1.5),
        ({"supervisor_age_s": 4.0}, 4.0),
        (around(scan_age_s=0.75), 0.75),
        (around(depth_age_s=1.25), 1.25),
        (around(pose_age_s=1.25), 1.25),
        (around(imu_age_s=0.75), 0.75),
    ],
)
def test_a_stale_cause_tells_its_age(changes: dict[str, Any], age_s: float) -> None:
    _, verdict = tick(SafetyState(), **changes)
    assert (verdict.age_s, verdict.measured) == (age_s, age_s)
    assert not verdict.limit >= age_s


OLD = {"sample_age_s": np.array([0.0, 0.015]), "climate_age_s": np.array([0.0, 0.6])}


@pytest.mark.parametrize(
    ("changes", "age_s"),
    [
        ({"velocity": np.array([0.0, 4.0])}, 0.015),
        ({"hardware_error": np.array([0, 1], dtype=np.uint8)}, 0.015),
        ({"watchdog_tripped": np.array([False, True])}, 0.015),
        (let_go(False, True, powered=(True, True)), 0.015),
        (excess(0.1, 0.1), 0.015),
        (within(0.1), 0.3),
        (around(tip_margin_ratio=0.1), 0.07),
        (around(tip_margin_ratio=0.4), 0.07),
        ({"temperature_c": np.array([30.0, 90.0])}, 0.6),
        ({"voltage_v": np.array([12.0, 5.0])}, 0.6),
        (right(fault_code=3, age_s=0.05), 0.05),
        (right(measured_rad_s=5.0, age_s=0.05), 0.05),
        (standing(**right(measured_rad_s=0.2, age_s=0.05)), 0.05),
        (close_by("environment_clearance", 0.0, 0.1), 0.015),
        (close_by("self_clearance", 0.0, 0.1), 0.015),
    ],
)
def test_a_measured_cause_tells_how_old_its_sample_is(
    changes: dict[str, Any], age_s: float
) -> None:
    around_it = {"pose_age_s": 0.3, "imu_age_s": 0.07, "depth_age_s": 0.2}
    changes = {**OLD, **changes, "around": around_it | changes.get("around", {})}
    _, verdict = ticks(SafetyState(), 50, **changes)
    assert verdict.cause is not Cause.NONE
    assert verdict.age_s == age_s


def test_a_cause_without_numbers_tells_none_and_its_text_leaves_them_out() -> None:
    _, verdict = tick(SafetyState(), estop_source="button")
    assert math.isnan(verdict.measured)
    assert math.isnan(verdict.limit)
    assert verdict.age_s == 0.0
    assert verdict.text == "estop (button); release the button, then reset, then arm"


@pytest.mark.parametrize(
    ("changes", "measured"),
    [
        ({"hardware_error": np.array([0, 32], dtype=np.uint8)}, 32.0),
        (right(fault_code=3), 3.0),
        ({"watchdog_tripped": np.array([False, True])}, 1.0),
        ({"watchdog_tripped": np.array([True, True])}, 2.0),
        (let_go(False, True, powered=(True, True)), 1.0),
        (let_go(True, True, powered=(True, True)), 2.0),
    ],
)
def test_what_must_not_be_at_all_is_measured_against_none(
    changes: dict[str, Any], measured: float
) -> None:
    _, verdict = ticks(SafetyState(), 3, **changes)
    assert (verdict.measured, verdict.limit) == (measured, 0.0)


def test_of_several_joints_the_first_is_named() -> None:
    _, verdict = ticks(SafetyState(), 5, velocity=np.array([2.5, 3.5]))
    assert (verdict.subject, verdict.measured) == ("shoulder", 2.5)


def test_a_lost_drive_tells_the_age_that_its_driver_allows() -> None:
    _, verdict = tick(SafetyState(), **right(lost=True, age_s=0.25))
    assert (verdict.measured, verdict.limit) == (0.25, 0.1)


def test_how_near_a_part_comes_is_as_old_as_the_oldest_joint_and_not_as_the_image() -> None:
    pair = Clearance(first="hand", second="floor", distance_m=0.0, closing_m_s=0.1)
    seen = around(environment_clearance=pair, depth_age_s=0.3)
    ages = {"sample_age_s": np.array([0.016, 0.004])}
    _, verdict = ticks(SafetyState(), 2, **seen, **ages)
    assert (verdict.age_s, verdict.limit) == (0.016, 0.01)


def test_among_equal_reactions_the_first_latched_is_reported_as_the_root_cause() -> None:
    state, _ = tick(SafetyState(), **SPOILERS[Cause.SUPERVISOR_LOST])
    state, verdict = tick(state, **SPOILERS[Cause.SERVO_BUS_LOST])
    assert verdict.cause is Cause.SUPERVISOR_LOST
    assert [v.cause for v in state.latched] == [Cause.SUPERVISOR_LOST, Cause.SERVO_BUS_LOST]


def test_a_reset_is_refused_while_one_of_several_latched_causes_persists() -> None:
    state, _ = tick(SafetyState(), estop_source="button", supervisor_age_s=9.0)
    after, verdict = tick(state, reset_requested=True, supervisor_age_s=9.0)
    assert verdict.reset is ResetOutcome.REFUSED
    assert after.latched == state.latched


def test_a_reset_with_nothing_to_reset_is_done() -> None:
    state, verdict = tick(SafetyState(), reset_requested=True)
    assert state == SafetyState()
    assert astuple(verdict) == astuple(replace(CLEAR, reset=ResetOutcome.DONE))


def test_an_estop_stays_latched_among_other_causes() -> None:
    state, _ = tick(SafetyState(), supervisor_age_s=9.0)
    assert not state.estop_latched
    state, _ = tick(state, estop_source="button")
    assert state.estop_latched


def test_what_has_no_release_time_does_not_linger() -> None:
    state, _ = tick(SafetyState(), **SPOILERS[Cause.STALE_COMMAND])
    assert state.lingering == ()


def test_a_latched_cause_is_not_latched_twice() -> None:
    state, _ = ticks(SafetyState(), 3, estop_source="button")
    assert len(state.latched) == 1


causes = st.sets(st.sampled_from(sorted(SPOILERS, key=lambda cause: cause.value)))


def spoiled(present: set[Cause]) -> dict[str, Any]:
    changes: dict[str, Any] = {}
    outside: dict[str, Any] = {"zones": ()}
    for cause in present:
        spoiler = SPOILERS[cause]
        more = spoiler.get("around", {})
        outside |= more | {"zones": outside["zones"] + more.get("zones", ())}
        changes |= spoiler
    return changes | {"around": outside}


def walk(history: list[set[Cause]]) -> Iterator[tuple[SafetyState, Verdict]]:
    state = SafetyState()
    for present in history:
        state, verdict = tick(state, **spoiled(present))
        yield state, verdict


@given(st.lists(causes, max_size=12))
def test_a_latch_never_clears_without_a_reset(history: list[set[Cause]]) -> None:
    before: tuple[Verdict, ...] = ()
    for state, verdict in walk(history):
        assert state.latched[: len(before)] == before
        assert verdict.reaction >= max((v.reaction for v in state.latched), default=0)
        before = state.latched


# Causes that spoil different inputs, so that adding one takes none away.
independent = st.sets(
    st.sampled_from(
        [
            Cause.ESTOP,
            Cause.SERVO_BUS_LOST,
            Cause.CAN_BUS_LOST,
            Cause.SERVO_HARDWARE_ERROR,
            Cause.SERVO_WATCHDOG_TRIPPED,
            Cause.SUPERVISOR_LOST,
            Cause.STALE_COMMAND,
            Cause.JOINT_CURRENT_LIMIT,
            Cause.JOINT_TEMPERATURE_LIMIT,
            Cause.JOINT_VOLTAGE_LIMIT,
            Cause.BUDGET_EXHAUSTED,
            Cause.COLLISION,
            Cause.SELF_COLLISION,
            Cause.ENVIRONMENT_COLLISION,
            Cause.WORKSPACE,
            Cause.TIP_OVER,
            Cause.STALE_SCAN,
            Cause.STALE_DEPTH,
            Cause.STALE_POSE,
            Cause.STALE_IMU,
            Cause.KEEP_OUT_ZONE,
            Cause.OBSTACLE_STOP_ZONE,
            Cause.OBSTACLE_SLOW_ZONE,
            Cause.OBSTACLE_LIMIT_ZONE,
            Cause.OBSTACLE_APPROACH,
        ]
    )
)


@given(st.lists(st.tuples(independent, independent), min_size=1, max_size=8))
def test_adding_a_cause_never_makes_the_verdict_less_restrictive(
    history: list[tuple[set[Cause], set[Cause]]],
) -> None:
    fewer = walk([few for few, _ in history])
    more = walk([few | extra for few, extra in history])
    for (_, mild), (_, strict) in zip(fewer, more, strict=True):
        assert strict.reaction >= mild.reaction
        assert strict.speed_ratio <= mild.speed_ratio
        assert strict.blocked >= mild.blocked


@given(st.lists(causes, max_size=6), causes)
def test_a_reset_clears_all_latches_or_none(history: list[set[Cause]], present: set[Cause]) -> None:
    state = [SafetyState(), *(state for state, _ in walk(history))][-1]
    after, verdict = tick(state, reset_requested=True, **spoiled(present))
    if verdict.reset is ResetOutcome.REFUSED:
        assert after.latched[: len(state.latched)] == state.latched
    else:
        assert {v.cause for v in after.latched} <= present


@given(st.lists(causes, max_size=6), causes)
def test_a_reset_touches_nothing_but_the_latch(
    history: list[set[Cause]], present: set[Cause]
) -> None:
    state = [SafetyState(), *(state for state, _ in walk(history))][-1]
    with_reset, after_reset = tick(state, reset_requested=True, **spoiled(present))
    without, before_reset = tick(state, **spoiled(present))
    assert with_reset.counts == without.counts
    assert each_plain(with_reset.lingering) == each_plain(without.lingering)
    assert set(each_plain(with_reset.latched)) <= set(each_plain(without.latched))
    assert after_reset.reaction <= before_reset.reaction


@given(st.lists(causes, max_size=8))
def test_judging_the_same_again_gives_the_same(history: list[set[Cause]]) -> None:
    once, again = (each_plain(chain.from_iterable(walk(history))) for _ in range(2))
    assert once == again


@given(st.lists(st.floats(0.0, 1.0), min_size=1, max_size=6))
def test_the_speed_that_is_left_is_the_least_of_all_zones(ratios: list[float]) -> None:
    kinds = (ZoneKind.SLOW, ZoneKind.LIMIT, ZoneKind.APPROACH)
    zones = tuple(
        zone(kinds[n % 3], f"zone {n}", speed_ratio=ratio) for n, ratio in enumerate(ratios)
    )
    assert tick(SafetyState(), **around(zones=zones))[1].speed_ratio == min(ratios)


@pytest.mark.parametrize(
    ("margin", "speed_ratio"), [(0.5, 1.0), (0.4375, 0.75), (0.375, 0.5), (0.28125, 0.125)]
)
def test_the_less_is_left_of_the_margin_against_tipping_the_slower_the_base(
    margin: float, speed_ratio: float
) -> None:
    _, verdict = tick(SafetyState(), **around(tip_margin_ratio=margin))
    assert verdict.speed_ratio == speed_ratio
    assert (verdict.cause is Cause.TIP_MARGIN) == (speed_ratio < 1.0)


@pytest.mark.parametrize("slow_below", [0.0, 0.25])
def test_a_base_that_is_not_to_slow_before_it_stops_does_not(slow_below: float) -> None:
    limits = replace(LIMITS, tip_slow_below_ratio=slow_below)
    _, verdict = evaluate(SafetyState(), inputs_with(around(tip_margin_ratio=0.26)), limits)
    assert verdict is CLEAR
    _, verdict = evaluate(SafetyState(), inputs_with(around(tip_margin_ratio=0.24)), limits)
    assert verdict.cause is not Cause.TIP_MARGIN
