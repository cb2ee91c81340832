"""Follow waypoints smoothly, and refuse those that joints cannot follow with the reason."""

from typing import Any

import numpy as np
import pytest

from vla_deploy.control.motion.axes import AxesState, AxisLimits
from vla_deploy.control.motion.trajectory import Trajectory, TrajectoryRefused, plan_trajectory

JOINTS = ("shoulder", "elbow")
LIMITS = AxisLimits(velocity=np.full(2, 2.0), acceleration=np.full(2, 8.0), jerk=np.full(2, 80.0))
REST = AxesState(position=np.zeros(2), velocity=np.zeros(2), acceleration=np.zeros(2))
TIMES = [0.0, 1.0, 2.0, 3.5]
POINTS = [[0.0, 0.0], [0.4, -0.2], [0.8, 0.1], [1.0, 0.5]]


def plan(times: Any = TIMES, points: Any = POINTS, start: AxesState = REST) -> Trajectory:
    return plan_trajectory(
        JOINTS,
        np.array(times, dtype=float),
        np.array(points, dtype=float),
        start,
        LIMITS,
        (np.full(2, -1.5), np.full(2, 1.5)),
        np.full(2, 0.05),
    )


def test_it_passes_every_point_at_its_time() -> None:
    trajectory = plan()
    for time_s, point in zip(TIMES, POINTS, strict=True):
        assert trajectory.sample(time_s).position == pytest.approx(point)


def test_velocity_and_acceleration_are_continuous_at_the_points() -> None:
    trajectory = plan()
    for time_s in TIMES[1:-1]:
        before, after = trajectory.sample(time_s - 1e-9), trajectory.sample(time_s + 1e-9)
        assert before.velocity == pytest.approx(after.velocity, abs=1e-6)
        assert before.acceleration == pytest.approx(after.acceleration, abs=1e-6)


def test_it_starts_with_the_present_velocity_and_ends_at_rest() -> None:
    moving = AxesState(
        position=np.array([0.01, -0.01]), velocity=np.array([0.3, 0.0]), acceleration=np.zeros(2)
    )
    trajectory = plan(start=moving)
    assert trajectory.sample(0.0).position == pytest.approx(moving.position)
    assert trajectory.sample(0.0).velocity == pytest.approx(moving.velocity)
    end = trajectory.sample(trajectory.duration_s)
    assert end.position == pytest.approx(POINTS[-1])
    assert (end.velocity == 0.0).all()
    assert trajectory.sample(trajectory.duration_s - 1e-9).velocity == pytest.approx(0.0, abs=1e-6)


def test_two_points_are_enough_and_a_late_first_time_starts_from_the_setpoint() -> None:
    trajectory = plan([1.0, 2.0], [[0.3, 0.3], [0.5, 0.5]])
    assert trajectory.sample(0.0).position == pytest.approx([0.0, 0.0])
    assert trajectory.sample(1.0).position == pytest.approx([0.3, 0.3])


@pytest.mark.parametrize(
    ("times", "points", "message"),
    [
        (TIMES, [[0.2, 0.0], *POINTS[1:]], "shoulder: start 0.2, limit 0.05"),
        (TIMES, [*POINTS[:-1], [1.0, 1.7]], "elbow: position above range by"),
        (TIMES, [*POINTS[:-1], [-1.7, 0.5]], "shoulder: position below range by"),
        ([0.0, 0.2, 1.2, 2.7], POINTS, "shoulder: velocity"),
        ([0.0, 1.0], [[0.0, 0.0], [0.0, 1.0], [0.0, 1.2]], "one per time"),
        ([0.0], [[0.0, 0.0]], "at least 2 points"),
        ([0.0, 1.0, 1.0, 2.0], POINTS, "increase"),
        ([-1.0, 1.0, 1.5, 2.0], POINTS, "increase"),
        ([0.0, 1.0, float("nan"), 2.0], POINTS, "finite"),
        (np.arange(300.0), np.zeros((300, 2)), "at most 256"),
    ],
)
def test_it_is_refused_with_joint_value_and_limit(times: Any, points: Any, message: str) -> None:
    with pytest.raises(TrajectoryRefused, match=message):
        plan(times, points)


def test_a_jolt_is_refused() -> None:
    jolt = [[0.0, 0.0], [0.09, 0.0], [0.0, 0.0], [0.09, 0.0]]
    with pytest.raises(TrajectoryRefused, match="shoulder: acceleration"):
        plan([0.0, 0.1, 0.2, 0.3], jolt)
