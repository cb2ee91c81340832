"""Hold that nothing leaves for the joints beyond range or speed, whatever is planned."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from vla_deploy.control.output.limits import SetpointGate

LOWER, UPPER, VELOCITY = np.array([-1.0, 0.0]), np.array([1.0, 0.04]), np.array([2.0, 0.08])
PERIOD_S = 0.004
BOTH = np.array([True, True])


@pytest.fixture
def gate() -> SetpointGate:
    gate = SetpointGate(LOWER, UPPER, VELOCITY)
    gate.place(np.array([0.0, 0.02]), BOTH)
    return gate


def test_a_plan_within_the_limits_passes_untouched(gate: SetpointGate) -> None:
    wanted = np.array([0.008, 0.0203])
    assert (gate.limit(wanted, PERIOD_S) == wanted).all()
    assert not gate.clamped


def test_a_jump_becomes_a_step_that_the_velocity_allows(gate: SetpointGate) -> None:
    sent = gate.limit(np.array([0.9, 0.02]), PERIOD_S)
    assert sent[0] == pytest.approx(1.25 * 2.0 * PERIOD_S)
    assert gate.clamped


def test_a_setpoint_beyond_the_range_stops_at_its_end(gate: SetpointGate) -> None:
    for _ in range(300):
        sent = gate.limit(np.array([5.0, -1.0]), PERIOD_S)
    assert sent.tolist() == [1.0, 0.0]


def test_a_joint_placed_outside_its_range_stays_and_may_only_come_back(gate: SetpointGate) -> None:
    gate.place(np.array([1.2, 9.0]), np.array([True, False]))
    assert gate.limit(np.array([1.2, 0.02]), PERIOD_S)[0] == 1.2
    assert gate.limit(np.array([1.3, 0.02]), PERIOD_S)[0] == 1.2
    assert gate.limit(np.array([1.19, 0.02]), PERIOD_S)[0] == 1.19
    assert gate.limit(np.array([1.2, 0.02]), PERIOD_S)[0] == 1.19


def test_a_setpoint_that_is_no_number_keeps_the_last_one(gate: SetpointGate) -> None:
    assert gate.limit(np.array([np.nan, 0.02]), PERIOD_S).tolist() == [0.0, 0.02]


@given(st.lists(st.floats(allow_nan=True, allow_infinity=True), min_size=1, max_size=30))
def test_no_input_gets_out_of_range_or_too_fast(wanted: list[float]) -> None:
    gate = SetpointGate(LOWER, UPPER, VELOCITY)
    gate.place(np.array([0.5, 0.02]), BOTH)
    last = gate.sent
    for value in wanted:
        sent = gate.limit(np.array([value, value]), PERIOD_S)
        assert (sent >= LOWER).all()
        assert (sent <= UPPER).all()
        assert (np.abs(sent - last) <= 1.25 * VELOCITY * PERIOD_S + 1e-12).all()
        last = sent
