"""Sweep each cause across its boundary and hold the latch, debounce and reset rules."""

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from vla_deploy.safety import (
    CLEAR,
    RULES,
    Cause,
    DriveSample,
    Latch,
    Reaction,
    ResetBy,
    ResetOutcome,
    Rule,
    SafetyInputs,
    SafetyLimits,
    SafetyState,
    Verdict,
    evaluate,
)

LIMITS = SafetyLimits(
    joint_names=("shoulder", "elbow"),
    position_lower=np.array([-1.0, 0.0]),
    position_upper=np.array([1.0, 2.0]),
    outward_velocity=np.array([0.05, 0.05]),
    velocity=np.array([2.0, 3.0]),
    following_error=np.array([0.25, np.inf]),
    wheel_error_rad_s=0.25,
    wheel_error_ratio=0.5,
    servo_age_s=0.02,
    base_command_age_s=0.25,
    supervisor_age_s=3.0,
)
LEFT = DriveSample(
    name="left_wheel",
    lost=False,
    age_s=0.0,
    fault_code=0,
    commanded_rad_s=0.0,
    measured_rad_s=0.0,
)
HEALTHY = SafetyInputs(
    energised=True,
    estop_source=None,
    reset_requested=False,
    position=np.array([0.0, 1.0]),
    velocity=np.zeros(2),
    setpoint=np.array([0.0, 1.0]),
    torque_enabled=np.array([True, True]),
    sample_age_s=np.zeros(2),
    hardware_error=np.zeros(2, dtype=np.uint8),
    watchdog_tripped=np.array([False, False]),
    lost_servo_buses=(),
    lost_can_buses=(),
    drives=(LEFT, replace(LEFT, name="right_wheel")),
    base_moving=True,
    base_command_age_s=0.0,
    supervisor_age_s=0.0,
)
ULP = 1e-12


def right(**changes: Any) -> dict[str, Any]:
    return {"drives": (LEFT, replace(LEFT, name="right_wheel", **changes))}


def turning(commanded_rad_s: float, measured_rad_s: float) -> dict[str, Any]:
    return right(commanded_rad_s=commanded_rad_s, measured_rad_s=measured_rad_s)


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
)
BY_CAUSE = {rule.cause: rule for rule in RULES}
SPOILERS = {cause: changes for cause, changes, _, _ in reversed(BOUNDARIES)}
cases = pytest.mark.parametrize(("cause", "bad", "good", "subject"), BOUNDARIES)
rules = pytest.mark.parametrize("rule", RULES, ids=[rule.cause.value for rule in RULES])


def tick(state: SafetyState, **changes: Any) -> tuple[SafetyState, Verdict]:
    return evaluate(state, replace(HEALTHY, **changes), LIMITS)


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


@cases
def test_a_cause_is_not_found_at_its_limit(
    cause: Cause, bad: dict[str, Any], good: dict[str, Any], subject: str
) -> None:
    _, verdict = ticks(SafetyState(), 60, **good)
    assert verdict is CLEAR


@rules
def test_a_cause_acts_only_after_its_debounce(rule: Rule) -> None:
    state, verdict = ticks(SafetyState(), rule.debounce_samples - 1, **SPOILERS[rule.cause])
    assert verdict.reaction is Reaction.NONE
    _, verdict = tick(state, **SPOILERS[rule.cause])
    assert verdict.reaction is rule.reaction


@pytest.mark.parametrize("rule", [rule for rule in RULES if rule.debounce_samples > 1])
def test_one_good_sample_starts_the_debounce_again(rule: Rule) -> None:
    state, _ = ticks(SafetyState(), rule.debounce_samples - 1, **SPOILERS[rule.cause])
    state, _ = tick(state)
    _, verdict = ticks(state, rule.debounce_samples - 1, **SPOILERS[rule.cause])
    assert verdict.reaction is Reaction.NONE


@rules
def test_a_latched_cause_outlives_itself_until_reset(rule: Rule) -> None:
    state, _ = ticks(SafetyState(), rule.debounce_samples, **SPOILERS[rule.cause])
    state, verdict = ticks(state, 100)
    latches = rule.latch is not Latch.NEVER
    assert verdict.cause is (rule.cause if latches else Cause.NONE)
    assert verdict.latched is latches
    state, verdict = tick(state, reset_requested=True)
    assert verdict == replace(CLEAR, reset=ResetOutcome.DONE)
    assert state == SafetyState()


@rules
def test_reset_is_refused_while_a_latched_cause_persists(rule: Rule) -> None:
    state, _ = ticks(SafetyState(), rule.debounce_samples, **SPOILERS[rule.cause])
    after, verdict = tick(state, reset_requested=True, **SPOILERS[rule.cause])
    assert verdict.reaction is rule.reaction
    refused = rule.latch is not Latch.NEVER
    assert verdict.reset is (ResetOutcome.REFUSED if refused else ResetOutcome.DONE)
    assert after.latched == state.latched


@rules
def test_only_the_estop_latches_while_nothing_is_energised(rule: Rule) -> None:
    changes = {**SPOILERS[rule.cause], "energised": False}
    state, verdict = ticks(SafetyState(), rule.debounce_samples, **changes)
    assert verdict.cause is rule.cause
    assert bool(state.latched) is (rule.cause is Cause.ESTOP)
    assert state.estop_latched is (rule.cause is Cause.ESTOP)


def test_what_latches_waits_for_the_operator_and_the_rest_does_not() -> None:
    automatic = {rule.cause for rule in RULES if rule.reset_by is ResetBy.AUTOMATIC}
    assert automatic == {Cause.STALE_COMMAND}


@pytest.mark.parametrize("cause", [Cause.JOINT_POSITION_LIMIT, Cause.JOINT_VELOCITY_LIMIT])
def test_a_joint_without_torque_has_no_limits(cause: Cause) -> None:
    off = {"torque_enabled": np.array([False, True])}
    _, verdict = ticks(SafetyState(), 60, **SPOILERS[cause], **off)
    assert verdict is CLEAR


def test_a_joint_without_torque_has_no_following_error() -> None:
    changes = SPOILERS[Cause.FOLLOWING_ERROR] | {"torque_enabled": np.array([False, True])}
    assert ticks(SafetyState(), 60, **changes)[1] is CLEAR


def test_the_numbers_of_a_finding_reach_its_text() -> None:
    _, verdict = ticks(SafetyState(), 2, **at(1.25, 0.5))
    assert (verdict.measured, verdict.limit) == (1.25, 1.0)
    assert "1.25, limit 1;" in verdict.text
    _, verdict = ticks(SafetyState(), 2, **at(-1.5, -0.5))
    assert (verdict.measured, verdict.limit) == (-1.5, -1.0)


@pytest.mark.parametrize(
    ("changes", "age_s"),
    [
        ({"sample_age_s": np.array([0.5, 0.0])}, 0.5),
        (right(lost=True, age_s=0.75), 0.75),
        ({"base_command_age_s": 1.5}, 1.5),
        ({"supervisor_age_s": 4.0}, 4.0),
    ],
)
def test_a_stale_cause_tells_its_age(changes: dict[str, Any], age_s: float) -> None:
    _, verdict = tick(SafetyState(), **changes)
    assert (verdict.age_s, verdict.measured) == (age_s, age_s)
    assert not verdict.limit >= age_s


def test_among_equal_reactions_the_first_latched_is_reported_as_the_root_cause() -> None:
    state, _ = tick(SafetyState(), **SPOILERS[Cause.SUPERVISOR_LOST])
    state, verdict = tick(state, **SPOILERS[Cause.SERVO_BUS_LOST])
    assert verdict.cause is Cause.SUPERVISOR_LOST
    assert [v.cause for v in state.latched] == [Cause.SUPERVISOR_LOST, Cause.SERVO_BUS_LOST]


def test_a_latched_cause_is_not_latched_twice() -> None:
    state, _ = ticks(SafetyState(), 3, estop_source="button")
    assert len(state.latched) == 1


causes = st.sets(st.sampled_from(sorted(SPOILERS, key=lambda cause: cause.value)))


def spoiled(present: set[Cause]) -> dict[str, Any]:
    return {key: value for cause in present for key, value in SPOILERS[cause].items()}


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


@given(st.lists(causes, max_size=6), causes)
def test_a_reset_clears_all_latches_or_none(history: list[set[Cause]], present: set[Cause]) -> None:
    state = [SafetyState(), *(state for state, _ in walk(history))][-1]
    after, verdict = tick(state, reset_requested=True, **spoiled(present))
    if verdict.reset is ResetOutcome.REFUSED:
        assert after.latched[: len(state.latched)] == state.latched
    else:
        assert {v.cause for v in after.latched} <= present
