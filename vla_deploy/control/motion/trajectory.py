"""Follow timed waypoints by a cubic spline, and refuse those that the joints cannot follow."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from vla_deploy.control.motion.axes import AxesState, AxisLimits, Floats

MAX_POINTS = 256
# Waypoints planned in another process may touch a limit; this share above it is still followed.
LIMIT_SLACK = 1.02
_ACCELERATION_SLACK = 3.0
_INSIDE = np.linspace(0.0, 1.0, 9)[:, None, None]


class TrajectoryRefused(ValueError):
    """Say why waypoints cannot be followed."""


class Trajectory:
    """Hold a twice continuous spline through timed points that ends at rest on the last one."""

    def __init__(self, times_s: Floats, positions: Floats, start_velocity: Floats) -> None:
        """Fit the spline; `positions` is an array of point by joint."""
        self.target: Floats = positions[-1]
        self.duration_s = float(times_s[-1])
        self._times = times_s
        self._coefficients = _spline(times_s, positions, start_velocity)

    def sample(self, elapsed_s: float) -> AxesState:
        """Return the state `elapsed_s` after the start; the last point at rest once it is over."""
        if elapsed_s >= self.duration_s:
            rest = np.zeros_like(self.target)
            return AxesState(position=self.target, velocity=rest, acceleration=rest)
        segment = max(int(np.searchsorted(self._times, elapsed_s, side="right")) - 1, 0)
        t = elapsed_s - self._times[segment]
        c0, c1, c2, c3 = self._coefficients[:, segment]
        return AxesState(
            position=c0 + t * (c1 + t * (c2 + t * c3)),
            velocity=c1 + t * (2.0 * c2 + 3.0 * t * c3),
            acceleration=2.0 * c2 + 6.0 * t * c3,
        )

    def extremes(self) -> tuple[Floats, Floats, Floats, Floats]:
        """Return each joint's lowest and highest position, top speed and top acceleration."""
        c0, c1, c2, c3 = self._coefficients
        t = _INSIDE * np.diff(self._times)[:, None]
        position = c0 + t * (c1 + t * (c2 + t * c3))
        speed = np.abs(c1 + t * (2.0 * c2 + 3.0 * t * c3))
        acceleration = np.abs(2.0 * c2 + 6.0 * t * c3)
        points = (0, 1)
        return (
            position.min(axis=points),
            position.max(axis=points),
            speed.max(axis=points),
            acceleration.max(axis=points),
        )


def plan_trajectory(
    joints: Sequence[str],
    times_s: Floats,
    positions: Floats,
    start: AxesState,
    limits: AxisLimits,
    position_range: tuple[Floats, Floats],
    start_tolerance: Floats,
) -> Trajectory:
    """Return the spline from the present setpoint through the waypoints.

    Raises:
        TrajectoryRefused: malformed, starts elsewhere, or exceeds a joint's limits.
    """
    _check_shape(joints, times_s, positions)
    if times_s[0] == 0.0:
        _check(joints, "start", np.abs(positions[0] - start.position), start_tolerance)
        positions = np.concatenate([start.position[None], positions[1:]])
    else:
        times_s = np.concatenate([[0.0], times_s])
        positions = np.concatenate([start.position[None], positions])
    trajectory = Trajectory(times_s, positions, start.velocity)
    low, high, speed, acceleration = trajectory.extremes()
    slack = start_tolerance
    _check(joints, "position below range by", position_range[0] - low, slack)
    _check(joints, "position above range by", high - position_range[1], slack)
    _check(joints, "velocity", speed, limits.velocity * LIMIT_SLACK)
    _check(joints, "acceleration", acceleration, limits.acceleration * _ACCELERATION_SLACK)
    return trajectory


def _check_shape(joints: Sequence[str], times_s: Floats, positions: Floats) -> None:
    if positions.shape != (len(times_s), len(joints)) or len(times_s) < 2:
        raise TrajectoryRefused(
            f"positions must be at least 2 points of {len(joints)} joints, one per time: got "
            f"{positions.shape} for {len(times_s)} times"
        )
    if len(times_s) > MAX_POINTS:
        raise TrajectoryRefused(f"{len(times_s)} points, at most {MAX_POINTS}: thin them out")
    if not (np.isfinite(times_s).all() and np.isfinite(positions).all()):
        raise TrajectoryRefused("times and positions must be finite numbers")
    if times_s[0] < 0.0 or (np.diff(times_s) <= 0.0).any():
        raise TrajectoryRefused("times must start at 0 or later and increase")


def _check(joints: Sequence[str], what: str, value: Floats, limit: Floats) -> None:
    worst = int((value - limit).argmax())
    if value[worst] > limit[worst]:
        raise TrajectoryRefused(
            f"{joints[worst]}: {what} {value[worst]:.4g}, limit {limit[worst]:.4g}"
        )


def _spline(times_s: Floats, positions: Floats, start_velocity: Floats) -> NDArray[np.float64]:
    """Return the coefficients c0..c3 of each segment and joint, clamped to rest at the end."""
    step = np.diff(times_s)[:, None]
    slope = np.diff(positions, axis=0) / step
    velocity = _knot_velocities(step, slope, start_velocity)
    v0, v1 = velocity[:-1], velocity[1:]
    c2 = (3.0 * slope - 2.0 * v0 - v1) / step
    c3 = (v0 + v1 - 2.0 * slope) / step**2
    return np.stack([positions[:-1], v0, c2, c3])


def _knot_velocities(step: Floats, slope: Floats, start_velocity: Floats) -> Floats:
    """Solve the tridiagonal system that makes the acceleration continuous (Thomas algorithm)."""
    count = len(step) + 1
    velocity = np.zeros((count, slope.shape[1]))
    velocity[0] = start_velocity
    if count == 2:
        return velocity
    diagonal = 2.0 * (step[:-1] + step[1:])[:, 0]
    right = 3.0 * (step[1:] * slope[:-1] + step[:-1] * slope[1:])
    right[0] -= step[1] * velocity[0]
    for i in range(1, count - 2):
        factor = step[i + 1, 0] / diagonal[i - 1]
        diagonal[i] -= factor * step[i - 1, 0]
        right[i] -= factor * right[i - 1]
    for i in range(count - 3, -1, -1):
        following = step[i, 0] * velocity[i + 2]
        velocity[i + 1] = (right[i] - following) / diagonal[i]
    return velocity
