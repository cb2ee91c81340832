import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from vla_deploy.skills.motion import minimum_jerk

LIMITS = np.array([1.0, 2.0, 0.5])
WAYPOINTS = arrays(np.float64, st.tuples(st.integers(2, 12), st.just(3)), elements=st.floats(-1, 1))


@given(WAYPOINTS)
def test_timed_waypoints_keep_the_speed_limits_and_rest_at_both_ends(waypoints: np.ndarray) -> None:
    times_s, positions = minimum_jerk(waypoints, LIMITS)
    speeds = np.abs(np.diff(positions, axis=0)) / np.diff(times_s)[:, None]
    assert (speeds <= LIMITS * 1.001).all()
    assert positions[0] == pytest.approx(waypoints[0], abs=1e-9)
    assert positions[-1] == pytest.approx(waypoints[-1], abs=1e-9)
    assert (speeds[[0, -1]] <= LIMITS * 0.3).all()


@given(WAYPOINTS)
def test_timed_waypoints_stay_between_their_neighbours(waypoints: np.ndarray) -> None:
    _, positions = minimum_jerk(waypoints, LIMITS)
    assert (positions >= waypoints.min(axis=0) - 1e-9).all()
    assert (positions <= waypoints.max(axis=0) + 1e-9).all()
