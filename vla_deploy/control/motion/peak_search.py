"""Find the peak velocity of a motion to rest: in closed form from rest, by search otherwise."""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from vla_deploy.control.motion.axes import (
    AxesState,
    AxisLimits,
    Floats,
    stopping,
    velocity_phase,
)

Flags = NDArray[np.bool_]

# 64 intervals, six times over, locate a peak velocity to 3e-11 of its range.
_UNIT = np.linspace(0.0, 1.0, 65)[:, None]
_ZOOMS = 6
_TINY = 1e-9


def peak_from_rest(distance: Floats, limits: AxisLimits) -> tuple[Floats, Floats]:
    """Return peak velocity and total time of the fastest motions that start at rest."""
    length = np.abs(distance)
    ramp_s = limits.acceleration / limits.jerk
    without_hold = np.cbrt((0.5 * length) ** 2 * limits.jerk)
    with_hold = (
        0.5
        * limits.acceleration
        * (np.sqrt(ramp_s**2 + 4.0 * length / limits.acceleration) - ramp_s)
    )
    short = without_hold <= limits.acceleration * ramp_s
    speed = np.minimum(np.where(short, without_hold, with_hold), limits.velocity)
    phase_s, phase_length = stopping(speed, limits)
    cruise_s = np.maximum(length - 2.0 * phase_length, 0.0) / np.maximum(speed, _TINY)
    return np.copysign(speed, distance), 2.0 * phase_s + cruise_s


def fastest_peak(start: AxesState, distance: Floats, limits: AxisLimits) -> tuple[Floats, Floats]:
    """Return each axis' peak velocity and total time: the fastest of a cruise and of every root."""

    def missing(peak: Floats) -> tuple[Floats, Floats]:
        covered, phases_s = _two_phases(start, peak, limits)
        return distance - covered, phases_s

    top = limits.velocity
    peak, found = _root(missing, -top, top)
    total_s = np.where(found, missing(peak)[1], np.inf)
    for cruise_at in (top, -top):
        left, phases_s = missing(cruise_at)
        cruise_total_s = phases_s + left / cruise_at
        faster = (left * cruise_at >= 0.0) & (cruise_total_s < total_s)
        peak = np.where(faster, cruise_at, peak)
        total_s = np.where(faster, cruise_total_s, total_s)
    return peak, total_s


def slower_peak(
    start: AxesState, distance: Floats, limits: AxisLimits, arrival_s: float
) -> tuple[Floats, Flags]:
    """Return the gentlest peak velocity that arrives at `arrival_s`, and where there is one."""

    def too_long(peak: Floats) -> tuple[Floats, Floats]:
        covered, phases_s = _two_phases(start, peak, limits)
        return phases_s + cruise_s(distance - covered, peak) - arrival_s, np.abs(peak)

    still = np.zeros_like(distance)
    beyond_stop = distance - _two_phases(start, still, limits)[0]
    peak, found = _root(too_long, still, np.copysign(limits.velocity, beyond_stop))
    covered, _ = _two_phases(start, peak, limits)
    return peak, found & (cruise_s(distance - covered, peak) >= 0.0)


def cruise_s(left: Floats, peak: Floats) -> Floats:
    """Return how long to cruise at `peak`; negative where the phases alone go too far."""
    still = np.abs(peak) < _TINY
    return np.where(still, np.inf, left / np.where(still, 1.0, peak))


def _two_phases(start: AxesState, peak: Floats, limits: AxisLimits) -> tuple[Floats, Floats]:
    """Return distance and time from the start to `peak` and from there to rest."""
    speed_up = velocity_phase(start.velocity, start.acceleration, peak, limits)
    stop_s, stop_length = stopping(peak, limits)
    return speed_up.covered + stop_length, speed_up.total_s + stop_s


def _root(
    evaluate: Callable[[Floats], tuple[Floats, Floats]], low: Floats, high: Floats
) -> tuple[Floats, Flags]:
    """Return where the value changes sign, at the least cost where it does so more than once."""
    axes = np.arange(len(low))
    found = np.zeros(len(low), dtype=np.bool_)
    for zoom in range(_ZOOMS):
        grid = low + (high - low) * _UNIT
        value, cost = evaluate(grid)
        positive = value >= 0.0
        crosses = positive[:-1] != positive[1:]
        if zoom == 0:
            found = crosses.any(axis=0)
        pick = np.where(crosses, cost[:-1] + cost[1:], np.inf).argmin(axis=0)
        low, high = grid[pick, axes], grid[pick + 1, axes]
    nearer = np.abs(value[pick, axes]) <= np.abs(value[pick + 1, axes])
    return np.where(nearer, low, high), found
