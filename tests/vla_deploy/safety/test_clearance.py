"""Clearances where the joints come to rest, and points beyond their boxes."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from vla_deploy.safety.clearance import (
    PLAY_M,
    JointBounds,
    JointMotion,
    beyond_box,
    least_distances,
    nearest_pair,
    stopping,
)

BOUNDS = JointBounds(
    lower=np.array([-1.0, 0.0]),
    upper=np.array([1.0, 0.04]),
    velocity=np.array([1.0, 0.1]),
    acceleration=np.array([4.0, 0.5]),
    jerk=np.array([40.0, 5.0]),
    following=np.array([0.15, 0.002]),
    reaction_s=0.1,
)
PAIRS = (("hand", "torso"), ("hand", "head"), ("elbow", "torso"))
LIMIT_M = 0.005
LEAST = np.full(3, LIMIT_M)
LOW, HIGH = np.array([[-1.0, -1.0, 0.0]] * 2), np.array([[1.0, 1.0, 1.0]] * 2)

speeds = arrays(np.float64, 2, elements=st.floats(-2.0, 2.0))


def driven(
    position: np.ndarray, velocity: np.ndarray, acceleration: np.ndarray | None = None
) -> JointMotion:
    """Return the motion of joints that follow their setpoints exactly."""
    return JointMotion(
        position=position,
        velocity=velocity,
        setpoint=position,
        setpoint_velocity=velocity,
        setpoint_acceleration=np.zeros(2) if acceleration is None else acceleration,
    )


def test_standing_joints_stay_where_they_are() -> None:
    here = np.array([0.2, 0.01])
    at_rest = stopping(driven(here, np.zeros(2)), BOUNDS)
    assert at_rest.start.tolist() == at_rest.position.tolist() == here.tolist()
    assert at_rest.time_s == BOUNDS.reaction_s


def test_what_a_servo_tells_of_a_standing_joint_that_does_not_follow_is_no_motion() -> None:
    motion = JointMotion(
        position=np.array([0.5, 0.02]),
        velocity=np.array([0.03, -0.003]),
        setpoint=np.array([0.0, 0.01]),
        setpoint_velocity=np.zeros(2),
        setpoint_acceleration=np.zeros(2),
    )
    at_rest = stopping(motion, BOUNDS)
    assert at_rest.start.tolist() == at_rest.position.tolist() == [0.5, 0.02]
    moving = stopping(replace(motion, velocity=np.array([0.031, -0.003])), BOUNDS)
    assert moving.position[0] > 0.5


def test_a_setpoint_that_creeps_is_motion() -> None:
    at_rest = stopping(driven(np.zeros(2), np.array([0.001, 0.0])), BOUNDS)
    assert at_rest.position[0] > 0.0001


def test_a_moving_joint_needs_its_reaction_onset_and_braking_way() -> None:
    at_rest = stopping(driven(np.array([0.0, 0.02]), np.array([-0.8, 0.0])), BOUNDS)
    onset_s = 4.0 / 40.0
    assert at_rest.position[0] == pytest.approx(-0.8 * (0.1 + 0.5 * onset_s + 0.5 * 0.8 / 4.0))
    assert at_rest.time_s == pytest.approx(0.1 + onset_s + 0.8 / 4.0)


@pytest.mark.parametrize("acceleration", [4.0, 9.0])
def test_a_joint_that_brakes_already_needs_less_way(acceleration: float) -> None:
    velocity, gain = np.array([-0.8, 0.0]), np.array([acceleration, 0.0])
    at_rest = stopping(driven(np.array([0.0, 0.02]), velocity, gain), BOUNDS)
    assert at_rest.position[0] == pytest.approx(-0.8 * (0.1 + 0.1))
    assert at_rest.time_s == pytest.approx(0.1 + 0.8 / 4.0)


def stopped(speed: float, gain: float, reaction_s: float) -> tuple[float, float]:
    """Return way and time of a joint that goes on as it does, then brakes within its bounds."""
    step_s, way, time_s = 1e-4, 0.0, 0.0
    while speed > 0.0:
        way, time_s = way + speed * step_s, time_s + step_s
        speed += gain * step_s
        if time_s > reaction_s:
            gain = max(gain - BOUNDS.jerk[0] * step_s, -BOUNDS.acceleration[0])
    return way, time_s


@pytest.mark.parametrize(("speed", "gain"), [(0.3, 1.0), (0.3, 4.0), (0.8, 2.0), (0.05, 3.0)])
def test_a_joint_that_gains_speed_needs_the_way_of_the_speed_that_it_reaches(
    speed: float, gain: float
) -> None:
    velocity, gains = np.array([-speed, 0.0]), np.array([-gain, 0.0])
    at_rest = stopping(driven(np.array([1.0, 0.02]), velocity, gains), BOUNDS)
    way, time_s = stopped(speed, gain, BOUNDS.reaction_s)
    assert way < 1.0 - at_rest.position[0] < way + 0.01
    assert time_s < at_rest.time_s < time_s + 0.06


def test_the_way_of_a_joint_that_gains_speed_is_that_of_each_phase() -> None:
    velocity, gain = np.array([0.8, 0.0]), np.array([4.0, 0.0])
    at_rest = stopping(driven(np.array([-0.5, 0.02]), velocity, gain), BOUNDS)
    reached, peak = 0.8 + 4.0 * 0.1, 0.8 + 4.0 * 0.1 + 0.5 * 4.0 * 0.1
    gaining = 0.1 * (0.8 + 0.5 * 4.0 * 0.1) + 0.1 * (reached + 4.0 * 0.1 / 3.0)
    braking = 0.5 * peak * (0.1 + peak / 4.0)
    assert at_rest.position[0] == pytest.approx(-0.5 + gaining + braking)
    assert at_rest.time_s == pytest.approx(0.1 + 0.1 + 0.1 + peak / 4.0)


def test_a_joint_that_does_not_follow_counts_from_where_it_is() -> None:
    motion = JointMotion(
        position=np.array([0.5, 0.02]),
        velocity=np.array([0.8, 0.0]),
        setpoint=np.array([0.0, 0.02]),
        setpoint_velocity=np.array([-0.8, 0.0]),
        setpoint_acceleration=np.zeros(2),
    )
    assert stopping(motion, BOUNDS).position[0] == pytest.approx(0.5 + 0.8 * 0.25)


def test_no_joint_stops_beyond_its_range_but_one_may_stand_there() -> None:
    at_rest = stopping(driven(np.array([0.95, -0.01]), np.array([1.0, -0.05])), BOUNDS)
    assert at_rest.position.tolist() == [1.0, -0.01]


@given(speeds, st.floats(1.0, 3.0))
def test_a_faster_joint_never_stops_sooner(velocity: np.ndarray, factor: float) -> None:
    here = np.array([0.0, 0.02])
    slow = stopping(driven(here, velocity), BOUNDS)
    fast = stopping(driven(here, velocity * factor), BOUNDS)
    assert (np.abs(fast.position - here) >= np.abs(slow.position - here) - 1e-12).all()
    assert fast.time_s >= slow.time_s


def test_the_nearest_pair_is_told_while_none_closes() -> None:
    found = nearest_pair(PAIRS, np.array([0.3, 0.1, 0.2]), np.array([0.3, 0.1, 0.2]), LEAST, 0.2)
    assert found is not None
    assert (found.first, found.second) == ("hand", "head")
    assert (found.distance_m, found.closing_m_s) == (0.1, 0.0)


def test_a_pair_that_closes_goes_before_one_that_rests_nearer() -> None:
    found = nearest_pair(PAIRS, np.array([0.3, 0.0, 0.2]), np.array([0.25, 0.0, 0.1]), LEAST, 0.5)
    assert found is not None
    assert (found.first, found.second) == ("elbow", "torso")
    assert found.distance_m == 0.1
    assert found.closing_m_s == pytest.approx(0.2)


def test_a_pair_that_opens_does_not_close() -> None:
    found = nearest_pair(PAIRS[:1], np.array([0.01]), np.array([0.05]), LEAST[:1], 0.2)
    assert found is not None
    assert found.closing_m_s == 0.0


def test_without_pairs_there_is_no_clearance() -> None:
    assert nearest_pair((), np.zeros(0), np.zeros(0), LEAST[:0], 0.1) is None


def test_a_pair_that_lay_near_when_power_came_hides_none_that_comes_near_now() -> None:
    least_m = np.array([0.005, -0.004, 0.005])
    found = nearest_pair(
        PAIRS, np.array([0.3, 0.0, 0.1]), np.array([0.3, -0.001, 0.004]), least_m, 0.1
    )
    assert found is not None
    assert (found.first, found.distance_m, found.least_m) == ("elbow", 0.004, 0.005)
    found = nearest_pair(
        PAIRS, np.array([0.3, 0.0, 0.1]), np.array([0.3, -0.006, 0.09]), least_m, 0.1
    )
    assert found is not None
    assert (found.second, found.distance_m, found.least_m) == ("head", -0.006, -0.004)


def test_before_power_comes_a_pair_may_be_where_it_is_and_no_nearer() -> None:
    here = np.array([0.2, -0.001, LIMIT_M + 0.001])
    least_m = least_distances(LEAST, here, LIMIT_M, powered=False)
    assert least_m == pytest.approx([LIMIT_M, -0.001 - PLAY_M, LIMIT_M + 0.001 - PLAY_M])
    sunk = least_distances(least_m, here - 0.01, LIMIT_M, powered=False)
    assert sunk[1] == pytest.approx(-0.011 - PLAY_M)


def test_under_power_what_has_parted_may_not_come_as_near_again() -> None:
    least_m = least_distances(LEAST, np.full(3, -0.001), LIMIT_M, powered=False)
    apart = least_distances(least_m, np.array([0.002, 0.02, -0.001]), LIMIT_M, powered=True)
    assert apart == pytest.approx([0.002 - PLAY_M, LIMIT_M, -0.001 - PLAY_M])
    assert (
        least_distances(apart, np.full(3, -0.001), LIMIT_M, powered=True).tolist() == apart.tolist()
    )


def test_inside_the_box_there_is_no_excess() -> None:
    inside = np.array([[0.0, 0.0, 0.5], [0.9, -0.9, 0.1]])
    assert beyond_box(("left", "right"), inside, inside, LOW, HIGH, 0.2) is None


def test_without_boxes_there_is_no_excess() -> None:
    assert beyond_box((), np.zeros((0, 3)), np.zeros((0, 3)), LOW[:0], HIGH[:0], 0.2) is None


def test_who_leaves_the_box_goes_before_who_is_further_out_and_comes_back() -> None:
    now = np.array([[1.0, 0.0, 0.5], [0.0, -1.5, 0.5]])
    ahead = np.array([[1.1, 0.0, 0.5], [0.0, -1.4, 0.5]])
    found = beyond_box(("left", "right"), now, ahead, LOW, HIGH, 0.2)
    assert found is not None
    assert found.subject == "left"
    assert found.excess_m == pytest.approx(0.1)
    assert found.rate_m_s == pytest.approx(0.5)
    found = beyond_box(("left", "right"), ahead, now, LOW, HIGH, 0.2)
    assert found is not None
    assert found.subject == "right"
    assert found.excess_m == pytest.approx(0.5)
    found = beyond_box(("left", "right"), ahead, ahead, LOW, HIGH, 0.2)
    assert found is not None
    assert (found.subject, found.rate_m_s) == ("right", 0.0)
