"""Plan time-optimal, jerk-limited motion to rest, for many axes at once.

Ruckig is the known library for this, but the registry has no aarch64 wheel of it for Python
3.12, which is what JetPack 7 runs; so this is our own, and ruckig is the arbiter in its tests. A
motion is a velocity phase of three constant-jerk segments from the present state to a peak
velocity, a cruise, and a velocity phase to rest. That is optimal from rest; from a moving start
about one motion in a hundred could be more than 5 % faster.
"""

from bisect import bisect_right

import numpy as np

from vla_deploy.control.motion.axes import AxesState, AxisLimits, Flags, Floats, velocity_phase
from vla_deploy.control.motion.peak_search import (
    cruise_s,
    fastest_peak,
    peak_from_rest,
    slower_peak,
)

SEGMENTS = 7
_TINY = 1e-9


class MotionProfile:
    """Hold piecewise constant-jerk motion of n axes that ends at rest on `target`."""

    def __init__(self, start: AxesState, durations: Floats, jerks: Floats, target: Floats) -> None:
        """Integrate the segments, given as arrays of axis by segment, from `start`."""
        self.target = target
        self._ends = np.cumsum(durations, axis=1)
        self._axis_ends = self._ends[:, -1]
        self.duration_s = float(self._axis_ends.max(initial=0.0))
        self._offset = np.arange(len(target)) * SEGMENTS
        begins = self._ends - durations
        self._table = np.stack([begins, *_integrate(start, durations, jerks), jerks])
        self._table = self._table.reshape(5, -1)
        self._changes_s: list[float] = np.unique(self._ends).tolist()
        self._between = bisect_right(self._changes_s, 0.0)
        self._look_up(0.0)

    def sample(self, elapsed_s: float) -> AxesState:
        """Return the state `elapsed_s` after the start; the target at rest once it is over."""
        if elapsed_s >= self.duration_s:
            rest = np.zeros_like(self.target)
            return AxesState(position=self.target, velocity=rest, acceleration=rest)
        between = bisect_right(self._changes_s, elapsed_s)
        if between != self._between:
            self._between = between
            self._look_up(elapsed_s)
        begin, p, v, a, jerk = self._rows
        moving = self._moving
        t = elapsed_s - begin
        half_jerk_t = 0.5 * jerk * t
        position = p + t * (v + t * (0.5 * a + half_jerk_t / 3.0))
        return AxesState(
            position=np.where(moving, position, self.target),
            velocity=(v + t * (a + half_jerk_t)) * moving,
            acceleration=(a + 2.0 * half_jerk_t) * moving,
        )

    def _look_up(self, elapsed_s: float) -> None:
        """Take each axis' segment, which stays the same until the next one of any axis ends."""
        segment = np.minimum((elapsed_s >= self._ends).sum(axis=1), SEGMENTS - 1)
        self._rows: Floats = self._table[:, segment + self._offset]
        self._moving: Flags = elapsed_s < self._axis_ends


def plan_motion(
    start: AxesState, target: Floats, limits: AxisLimits, *, together: bool = True
) -> MotionProfile:
    """Return the fastest motion to rest on `target` in which all moving axes arrive together.

    The limits hold throughout when the start can keep them; a start beyond them is brought back
    first. An axis that cannot be slowed without turning round arrives early. Unless `together`,
    each axis arrives as early as it can.
    """
    distance = target - start.position
    peak, total_s = peak_from_rest(distance, limits)
    moving = (start.velocity != 0.0) | (start.acceleration != 0.0)
    if moving.any():
        axes = np.flatnonzero(moving)
        peak[axes], total_s[axes] = fastest_peak(start.of(axes), distance[axes], limits.of(axes))
    if not together:
        return MotionProfile(start, *_segments(start, peak, distance, limits), target)
    arrival_s = float(total_s.max(initial=0.0))
    early = moving & (total_s < arrival_s - _TINY)
    if early.any():
        axes = np.flatnonzero(early)
        slower, found = slower_peak(start.of(axes), distance[axes], limits.of(axes), arrival_s)
        peak[axes] = np.where(found, slower, peak[axes])
    durations, jerks = _segments(start, peak, distance, limits)
    stretch = np.where(moving | (total_s <= 0.0), 1.0, arrival_s / np.maximum(total_s, _TINY))
    return MotionProfile(start, durations * stretch[:, None], jerks / stretch[:, None] ** 3, target)


def plan_stop(start: AxesState, limits: AxisLimits) -> MotionProfile:
    """Return the fastest jerk-limited motion to rest, wherever that ends."""
    rest = np.zeros_like(start.velocity)
    phase = velocity_phase(start.velocity, start.acceleration, rest, limits)
    durations = np.stack([*phase.durations, rest, rest, rest, rest], axis=1)
    jerks = np.stack([*phase.jerks, rest, rest, rest, rest], axis=1)
    return MotionProfile(start, durations, jerks, start.position + phase.covered)


def _segments(
    start: AxesState, peak: Floats, distance: Floats, limits: AxisLimits
) -> tuple[Floats, Floats]:
    """Return durations and jerks as arrays of axis by segment."""
    rest = np.zeros_like(peak)
    speed_up = velocity_phase(start.velocity, start.acceleration, peak, limits)
    slow_down = velocity_phase(peak, rest, rest, limits)
    cruise = cruise_s(distance - speed_up.covered - slow_down.covered, peak)
    cruise = np.where(np.isfinite(cruise), np.maximum(cruise, 0.0), 0.0)
    durations = np.stack([*speed_up.durations, cruise, *slow_down.durations], axis=1)
    return durations, np.stack([*speed_up.jerks, rest, *slow_down.jerks], axis=1)


def _integrate(start: AxesState, durations: Floats, jerks: Floats) -> Floats:
    """Return position, velocity and acceleration at the start of each segment."""
    states = np.empty((3, *durations.shape))
    p, v, a = start.position, start.velocity, start.acceleration
    for segment, (t, j) in enumerate(zip(durations.T, jerks.T, strict=True)):
        states[:, :, segment] = p, v, a
        p = p + t * (v + t * (0.5 * a + t * j / 6.0))
        v = v + t * (a + 0.5 * t * j)
        a = a + t * j
    return states
