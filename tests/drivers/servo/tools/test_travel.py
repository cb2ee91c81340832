from math import pi

import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivers.dynamixel.tables.control_table import CENTRE_PULSE, PULSE_RAD
from drivers.servo.tools.travel import (
    JointRange,
    ServoMounting,
    TravelLog,
    TravelRefused,
    held_position,
    judge_reach,
    judge_sweep,
    mounting_at,
    mounting_of_sweep,
)

ELBOW = JointRange(joint="elbow", low=0.0, high=2.6, sign=1, travel_per_rad=1.0)
FINGER = JointRange(joint="finger", low=0.0, high=0.046, sign=-1, travel_per_rad=0.012)
PULSES = round(ELBOW.pulses)


def refusal(*arguments: object, **named: object) -> str:
    with pytest.raises(TravelRefused) as caught:
        judge_sweep(*arguments, **named)
    return str(caught.value)


@given(
    start=st.integers(0, 4095),
    steps=st.lists(st.integers(-1500, 1500), max_size=30),
    wraps=st.booleans(),
)
def test_the_travel_is_the_same_whether_or_not_the_count_starts_over(start, steps, wraps):
    log, position = TravelLog({3: start}), start
    for step in steps:
        position += step
        log.feed({3: position % 4096 if wraps else position})
    assert log.travel(3) == position - start


def test_a_missing_sample_costs_nothing_and_an_unknown_servo_is_left_out():
    log = TravelLog({1: 100})
    log.feed({1: 300})
    log.feed({})
    log.feed({1: 500, 7: 3000})
    assert log.travel(1) == 400
    assert log.others_moved(1) == []


def test_others_moved_counts_a_swing_there_and_back():
    log = TravelLog({1: 100, 2: 100, 3: 100})
    for position in (200, 280, 100):
        log.feed({1: position, 2: position, 3: 100 + position // 4})
    assert log.others_moved(1) == [2]


def test_a_held_joint_gives_its_middle_sample_even_at_the_end_of_the_turn():
    assert held_position("elbow", [100, 101, 102, 101]) == 101
    assert held_position("elbow", [4095, 0, 1, 4094, 0]) in (4095, 4096)


@pytest.mark.parametrize(
    ("samples", "words"),
    [
        ([100, 120], "elbow: it moved by 1.8 degrees while it was measured; hold it still"),
        ([], "elbow: the servo gave no position"),
    ],
)
def test_a_joint_that_moves_while_it_is_measured_is_refused(samples, words):
    with pytest.raises(TravelRefused, match=words):
        held_position("elbow", samples)


def test_good_sweeps_are_taken_in_both_senses():
    judge_sweep(ELBOW, PULSES, [])
    judge_sweep(ELBOW, round(0.9 * PULSES), [])
    judge_sweep(FINGER, -round(FINGER.pulses), [])


@pytest.mark.parametrize(
    ("travel", "others", "words"),
    [
        (10, [], "elbow: it did not move; move elbow from end to end"),
        (10, ["wrist"], "elbow: it did not move; wrist moved instead"),
        (PULSES, ["wrist", "head"], "elbow: head, wrist moved too"),
        (PULSES // 2, [], r"elbow: it moved by 74.4 degrees, its range 0..2.6 is 149.0 degrees"),
        (PULSES * 2, [], "it moved by 297.9 degrees"),
        (-PULSES, [], "it went against its declared sign 1: begin at the lower end"),
    ],
)
def test_a_sweep_that_cannot_be_the_joints_is_refused_with_what_to_do(travel, others, words):
    assert words in refusal(ELBOW, travel, others)


def test_a_servo_that_was_remounted_is_taken_when_the_person_says_so():
    judge_sweep(ELBOW, -PULSES, [], accept_sign=True)


@given(offset=st.floats(1.3 - 0.5, 1.3 + 0.5), sign=st.sampled_from([-1, 1]))
@pytest.mark.parametrize("turns", [-1, 0, 2])
def test_a_sweep_finds_sign_and_offset_whatever_turn_the_servo_counts(turns, offset, sign):
    def pulse(value: float) -> int:
        return round((value - offset) / (sign * PULSE_RAD)) + CENTRE_PULSE + 4096 * turns

    travel = pulse(ELBOW.high) - pulse(ELBOW.low)
    found = mounting_of_sweep(ELBOW, pulse(ELBOW.low), travel)
    assert found.sign == sign
    assert found.offset == pytest.approx(offset, abs=PULSE_RAD)


@given(offset=st.floats(0.023 - 0.01, 0.023 + 0.01))
def test_one_known_pose_finds_the_offset_of_a_finger_in_metres(offset):
    value = 0.04
    pulse = (value - offset) / (FINGER.sign * PULSE_RAD * FINGER.travel_per_rad) + CENTRE_PULSE
    found = mounting_at(FINGER, round(pulse), value)
    assert found.sign == FINGER.sign
    assert found.offset == pytest.approx(offset, abs=0.012 * PULSE_RAD)


def test_a_travel_across_the_end_of_the_turn_is_refused_with_its_middle():
    mounting = ServoMounting(sign=1, offset=1.3)
    judge_reach(ELBOW, mounting, 0.03, 2.57)
    edge = ServoMounting(sign=1, offset=1.3 - 2.2)
    with pytest.raises(TravelRefused, match=rf"middle is at pulse {2048 + round(2.2 / PULSE_RAD)}"):
        judge_reach(ELBOW, edge, 0.03, 2.57)
    assert pi < 2.57 - edge.offset
