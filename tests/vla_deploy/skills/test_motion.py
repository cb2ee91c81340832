import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from vla_deploy.skills.movements.motion import minimum_jerk

VELOCITY = np.array([1.0, 2.0, 0.5])
ACCELERATION = np.array([4.0, 8.0, 2.0])
WAYPOINTS = arrays(np.float64, st.tuples(st.integers(2, 12), st.just(3)), elements=st.floats(-1, 1))
PRECISION = 2e-4


@given(WAYPOINTS)
def test_timed_waypoints_keep_the_limits_and_rest_at_both_ends(waypoints: np.ndarray) -> None:
    times_s, positions = minimum_jerk(waypoints, VELOCITY, ACCELERATION)
    speeds = np.diff(positions, axis=0) / np.diff(times_s)[:, None]
    changes = np.diff(speeds, axis=0) / np.diff(times_s)[1:, None]
    assert (np.abs(speeds) <= VELOCITY * 1.001).all()
    assert (np.abs(changes) <= ACCELERATION * 1.001).all()
    assert positions[0] == pytest.approx(waypoints[0], abs=PRECISION)
    assert positions[-1] == pytest.approx(waypoints[-1], abs=12 * PRECISION)


@given(WAYPOINTS)
def test_timed_waypoints_never_overshoot(waypoints: np.ndarray) -> None:
    _, positions = minimum_jerk(waypoints, VELOCITY, ACCELERATION)
    assert (positions >= waypoints.min(axis=0) - 1e-9).all()
    assert (positions <= waypoints.max(axis=0) + 1e-9).all()


def test_a_straight_move_takes_the_least_time_its_slowest_joint_allows() -> None:
    waypoints = np.linspace((0.0, 0.0, 0.0), (2.0, 1.0, 0.5), 30)
    times_s, _ = minimum_jerk(waypoints, VELOCITY, ACCELERATION)
    assert times_s[-1] == pytest.approx(1.875 * 2.0, rel=0.05)
