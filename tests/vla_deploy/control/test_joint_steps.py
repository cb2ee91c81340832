"""How far joints go between two samples is told per sample, over the time that lies between."""

import numpy as np
import pytest

from drivers.servo.state import BusState
from vla_deploy.control.output.joint_steps import JointSteps


def told(stamp_ns: int, positions: list[float], valid: list[bool]) -> BusState:
    state = BusState.of(2)
    state.position_rad[:] = positions
    state.valid[:] = valid
    state.stamp_ns = stamp_ns
    return state


def test_the_first_sample_is_no_step() -> None:
    steps = JointSteps(2)
    steps.take(told(4_000_000, [1.0, 2.0], [True, True]))
    assert steps.step.tolist() == [0.0, 0.0]
    assert steps.time_s.tolist() == [0.0, 0.0]


def test_a_silent_servos_next_sample_spans_its_silence() -> None:
    steps = JointSteps(2)
    steps.take(told(4_000_000, [1.0, 2.0], [True, True]))
    steps.take(told(8_000_000, [1.5, 2.0], [True, False]))
    assert steps.step.tolist() == [0.5, 0.0]
    assert steps.time_s == pytest.approx([0.004, 0.0])
    steps.take(told(12_000_000, [1.5, 2.25], [True, True]))
    assert steps.step.tolist() == [0.0, 0.25]
    assert steps.time_s == pytest.approx([0.004, 0.008])


def test_a_sample_that_is_read_twice_is_one_step() -> None:
    steps = JointSteps(2)
    steps.take(told(4_000_000, [1.0, 2.0], [True, True]))
    moved = told(8_000_000, [1.5, 2.5], [True, True])
    steps.take(moved)
    steps.take(moved)
    assert np.count_nonzero(steps.step) == np.count_nonzero(steps.time_s) == 0
