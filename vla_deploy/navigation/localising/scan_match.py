"""Fit a scan to the map: where it lies best, how sure that is, and whether it fits at all.

Points are matched to the surface that a distance field describes, by Gauss-Newton, so that each
point slides along its wall. The Hessian tells which directions the scan says anything about.
"""

import math
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from vla_deploy.navigation.localising.scan import ScanPoints
from vla_deploy.navigation.maps.distance_field import DistanceField
from vla_deploy.robots.floor_pose import Points, Pose2D, wrap_angle

Floats = NDArray[np.float64]

MIN_POINTS: Final = 60
INLIER_M: Final = 0.30
MATCH_M: Final = 0.10
# A beam that goes this far beyond a wall of the map went through it: nothing explains that but
# another place, or a wall that is gone. A shorter one has met a person, or a chair.
THROUGH_M: Final = 0.25
ITERATIONS: Final = 8
STEP_M: Final = 1e-4
# Neighbouring points share the error of the cell that they meet: so many are worth as one.
POINTS_PER_FACT: Final = 20.0
LEAST_RESIDUAL_M: Final = 0.015
# What a scan says nothing about is known to the basin of the match at best.
BASIN_M: Final = 0.5
BASIN_RAD: Final = 0.35


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Match:
    """Hold where a scan fits best.

    `shift` (x, y, yaw) moves the pose, turning about itself; `covariance` (3, 3) is that of the
    moved pose. Ratios are shares of the scan's points: near a wall of the map, or beyond one.
    """

    pose: Pose2D
    shift: Floats
    covariance: Floats
    match_ratio: float
    through_ratio: float

    @property
    def score(self) -> float:
        """Return how well the scan fits, at most 1."""
        return self.match_ratio - self.through_ratio


def fit(field: DistanceField, scan: ScanPoints, pose: Pose2D) -> Match:
    """Return the best place near `pose` for a scan given in the map frame as seen from there."""
    pivot = np.array([pose.x_m, pose.y_m])
    shift, hessian, residual_m = _settle(field, scan.ends, pivot)
    moved = ScanPoints(_moved(scan.starts, pivot, shift), _moved(scan.ends, pivot, shift))
    weakest = np.diag((BASIN_M**-2, BASIN_M**-2, BASIN_RAD**-2))
    facts = hessian / (POINTS_PER_FACT * residual_m**2)
    distance_m, _ = field.sample(moved.ends)
    return Match(
        pose=Pose2D(
            pose.x_m + float(shift[0]),
            pose.y_m + float(shift[1]),
            wrap_angle(pose.yaw_rad + float(shift[2])),
        ),
        shift=shift,
        covariance=np.asarray(np.linalg.inv(facts + weakest), dtype=np.float64),
        match_ratio=float(np.mean(np.abs(distance_m) < MATCH_M)),
        through_ratio=through_ratio(field, moved),
    )


def through_ratio(field: DistanceField, scan: ScanPoints) -> float:
    """Return the share of beams that end well behind a wall of the map."""
    directions, length_m = scan.beams()
    free_m = field.cast(scan.starts, directions, length_m)
    return float(np.mean(free_m < length_m - THROUGH_M))


def _settle(field: DistanceField, points: Points, pivot: Points) -> tuple[Floats, Floats, float]:
    """Return the shift about `pivot`, the Hessian there, and the spread of the residuals."""
    shift, hessian, distance_m = np.zeros(3), np.eye(3), np.zeros(1)
    weight = np.ones(1)
    for _ in range(ITERATIONS):
        moved = _moved(points, pivot, shift)
        distance_m, gradient = field.sample(moved)
        arm = moved - pivot - shift[:2]
        turn = gradient[:, 1] * arm[:, 0] - gradient[:, 0] * arm[:, 1]
        jacobian = np.column_stack((gradient, turn))
        weight = np.clip(1.0 - np.abs(distance_m) / INLIER_M, 0.0, 1.0)
        hessian = jacobian.T @ (weight[:, None] * jacobian)
        damped = hessian + np.diag((0.5, 0.5, 0.5))
        step = np.linalg.solve(damped, jacobian.T @ (weight * distance_m))
        shift -= step
        if float(np.abs(step).max()) < STEP_M:
            break
    spread_m2 = float((weight * distance_m**2).sum()) / max(float(weight.sum()), 1.0)
    return shift, hessian, max(LEAST_RESIDUAL_M, math.sqrt(spread_m2))


def _moved(points: Points, pivot: Points, shift: Floats) -> Points:
    c, s = math.cos(shift[2]), math.sin(shift[2])
    turned: Points = (points - pivot) @ np.array([[c, s], [-s, c]])
    return turned + pivot + shift[:2]
