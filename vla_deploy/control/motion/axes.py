"""Describe axes and the jerk-limited velocity phases that their motions are made of."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Axes = NDArray[np.intp]
Flags = NDArray[np.bool_]

_TINY = 1e-9


def any_of(flags: Flags) -> bool:
    """Return whether a flag is set; on a few axes, several times faster than numpy itself."""
    return 1 in flags.tobytes()


def all_of(flags: Flags) -> bool:
    """Return whether every flag is set."""
    return 0 not in flags.tobytes()


@dataclass(frozen=True, slots=True, kw_only=True)
class AxisLimits:
    """Carry each axis' largest velocity, acceleration and jerk."""

    velocity: Floats
    acceleration: Floats
    jerk: Floats

    def scaled(self, speed_ratio: float) -> "AxisLimits":
        """Return limits that give the same path at `speed_ratio` of the speed."""
        return AxisLimits(
            velocity=self.velocity * speed_ratio,
            acceleration=self.acceleration * speed_ratio**2,
            jerk=self.jerk * speed_ratio**3,
        )

    def of(self, axes: Axes) -> "AxisLimits":
        """Return the limits of some axes."""
        return AxisLimits(
            velocity=self.velocity[axes],
            acceleration=self.acceleration[axes],
            jerk=self.jerk[axes],
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class AxesState:
    """Carry each axis' position, velocity and acceleration at one time."""

    position: Floats
    velocity: Floats
    acceleration: Floats

    def of(self, axes: Axes) -> "AxesState":
        """Return the state of some axes."""
        return AxesState(
            position=self.position[axes],
            velocity=self.velocity[axes],
            acceleration=self.acceleration[axes],
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class JerkSegments:
    """Carry the three constant-jerk segments of each velocity change, and what they cover."""

    durations: tuple[Floats, Floats, Floats]
    jerks: tuple[Floats, Floats, Floats]
    total_s: Floats
    covered: Floats


def velocity_phase(v0: Floats, a0: Floats, v1: Floats, limits: AxisLimits) -> JerkSegments:
    """Return the fastest change from velocity v0 with acceleration a0 to v1 with none."""
    jerk = limits.jerk
    sign = np.where(v1 >= v0 + a0 * np.abs(a0) / (2.0 * jerk), 1.0, -1.0)
    a, dv = sign * a0, sign * (v1 - v0)
    top = np.minimum(np.sqrt(np.maximum(jerk * dv + 0.5 * a * a, 0.0)), limits.acceleration)
    rise = top - a
    t1, t3 = np.abs(rise) / jerk, top / jerk
    t2 = np.maximum(dv - 0.5 * ((top + a) * t1 + top * t3), 0.0) / np.maximum(top, _TINY)
    t2 *= top > _TINY
    j1, j3 = np.copysign(jerk, sign * rise), -sign * jerk
    peak_a = a0 + j1 * t1
    mid_v = v0 + 0.5 * (a0 + peak_a) * t1
    late_v = mid_v + peak_a * t2
    covered = (
        t1 * (v0 + t1 * (0.5 * a0 + j1 * t1 / 6.0))
        + t2 * 0.5 * (mid_v + late_v)
        + t3 * (late_v + peak_a * t3 / 3.0)
    )
    return JerkSegments(
        durations=(t1, t2, t3),
        jerks=(j1, np.zeros_like(j1), j3),
        total_s=t1 + t2 + t3,
        covered=covered,
    )


def stopping(peak: Floats, limits: AxisLimits) -> tuple[Floats, Floats]:
    """Return time and distance from `peak` without acceleration to rest, which is symmetric."""
    speed = np.abs(peak)
    top = np.minimum(np.sqrt(speed * limits.jerk), limits.acceleration)
    total_s = top / limits.jerk + speed / np.maximum(top, _TINY)
    return total_s, 0.5 * peak * total_s
