"""Judge how far the robot is from tipping over: pure geometry of the zero-moment point."""

import math

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

# With less than this share of its weight on the floor the robot is as good as tipping.
_LEAST_LOAD_M_S2 = 1.0


def zero_moment_point(centre_of_mass_m: Floats, acceleration_m_s2: Floats) -> Floats | None:
    """Return where weight and inertia press on the floor of the base frame, x and y.

    The accelerometer's reading points away from there: straight up at rest, and it leans with the
    floor. None while next to nothing presses down.
    """
    if acceleration_m_s2[2] < _LEAST_LOAD_M_S2:
        return None
    lean = acceleration_m_s2[:2] / acceleration_m_s2[2]
    return np.asarray(centre_of_mass_m[:2] - centre_of_mass_m[2] * lean)


def edge_distance(point: Floats, support: Floats) -> float:
    """Return the distance to the nearest edge of a convex, counter-clockwise polygon.

    It is negative outside.
    """
    along = np.roll(support, -1, axis=0) - support
    inward = np.column_stack((-along[:, 1], along[:, 0]))
    inward /= np.linalg.norm(inward, axis=1)[:, None]
    return float((inward * (point - support)).sum(axis=1).min())


def tip_margin_ratio(
    centre_of_mass_m: Floats, acceleration_m_s2: Floats, support: Floats, max_lean_rad: float
) -> float:
    """Return 1 for a robot that stands level over its support's middle, 0 where it begins to tip.

    The smaller one of two margins counts: of the zero-moment point from the support's edge, and
    of the lean from what is allowed.
    """
    point = zero_moment_point(centre_of_mass_m, acceleration_m_s2)
    if point is None:
        return 0.0
    whole_m = edge_distance(np.zeros(2), support)
    lean_rad = math.atan2(float(np.hypot(*acceleration_m_s2[:2])), float(acceleration_m_s2[2]))
    margin = edge_distance(point, support) / whole_m
    return min(max(min(margin, 1.0 - lean_rad / max_lean_rad), 0.0), 1.0)
