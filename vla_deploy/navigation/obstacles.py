"""Judge a lidar scan: does anything stand in the strip of floor that the body is about to sweep?"""

import numpy as np
from numpy.typing import NDArray

Points = NDArray[np.float64]

SIDE_MARGIN_M = 0.04
# The path keeps clear of what the map shows; of that, only imminent contact counts.
MAPPED_REACH_M = 0.05


def scan_points(ranges_m: NDArray[np.float64]) -> Points:
    """Return a scan's points in the base frame; beam i looks to i degrees, 0 m means no echo."""
    beams = np.flatnonzero(ranges_m > 0.0)
    angles = np.deg2rad(beams * (360.0 / len(ranges_m)))
    points: Points = ranges_m[beams, None] * np.column_stack((np.cos(angles), np.sin(angles)))
    return points


def is_blocked(
    points: Points, mapped: NDArray[np.bool_], *, reach_m: float, radius_m: float
) -> bool:
    """Return whether a body of that radius meets a point within `reach_m` ahead.

    `points` are (n, 2) with x along the motion; `mapped` marks those that the map shows too.
    """
    ahead, aside = points[:, 0], np.abs(points[:, 1])
    reach = np.where(mapped, min(reach_m, MAPPED_REACH_M), reach_m)
    half_width = radius_m + np.where(mapped, 0.0, SIDE_MARGIN_M)
    # The body is round: beside its middle its front lies further back.
    front = np.sqrt(np.maximum(0.0, half_width**2 - aside**2))
    return bool(((ahead > 0.0) & (aside < half_width) & (ahead < front + reach)).any())
