"""Filter a thing's position with a Kalman filter: what was known, and what an observation adds.

Things stand still until something moves them. So the state is a place with a covariance that grows
slowly while the thing is not seen, since somebody may have nudged it, and not a velocity that would
carry a noisy observation away. The estimate of a thing that was moved, or that a hand carries, is
set anew: its past says nothing.
"""

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from drivers.clock import NS_PER_S
from vla_deploy.perception.images.detection import Detection

Array = NDArray[np.float64]

# In one second in which the thing is not seen; 0.12 m after half an hour.
DRIFT_M2_S = 0.003**2
MOST_SIGMA_M = 0.15
CARRIED_SIGMA_M = 0.03
# What falls from a hand rolls away, and ends somewhere between the hand and the floor.
DROPPED_SIGMA_M = 0.25
# What the robot's pose and the model of a form add to each observation. These errors stay the same
# from image to image, so no number of observations averages them away.
POSE_M, POSE_RAD = 0.008, 0.006
FORM_M = 0.006
# Of a half-hidden thing the middle is not known, whatever is estimated.
HIDDEN_M, HIDDEN_OF_SIZE = 0.03, 0.125


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Estimate:
    """Hold a position (3,) in the map frame and its covariance (3, 3) at a moment."""

    position_m: Array
    covariance_m2: Array
    stamp_ns: int

    @property
    def sigma_m(self) -> Array:
        """Return the standard deviation along each axis."""
        deviations: Array = np.sqrt(np.diag(self.covariance_m2))
        return deviations


def predicted(estimate: Estimate, stamp_ns: int) -> Estimate:
    """Return what is known at a later moment: the same place, less surely, up to a bound."""
    age_s = max(0.0, (stamp_ns - estimate.stamp_ns) / NS_PER_S)
    room_m2 = max(0.0, MOST_SIGMA_M**2 - float(np.max(np.diag(estimate.covariance_m2))))
    growth_m2 = min(DRIFT_M2_S * age_s, room_m2)
    return Estimate(
        position_m=estimate.position_m,
        covariance_m2=estimate.covariance_m2 + growth_m2 * np.eye(3),
        stamp_ns=max(stamp_ns, estimate.stamp_ns),
    )


def updated(estimate: Estimate, seen: Estimate, looks: float = 1.0) -> Estimate:
    """Return what is known after an observation of a thing that stood still.

    `looks` is how many observations with the same error count as one.
    """
    before, noise = predicted(estimate, seen.stamp_ns), looks * seen.covariance_m2
    gain = before.covariance_m2 @ np.linalg.inv(before.covariance_m2 + noise)
    left = np.eye(3) - gain
    # Joseph's form stays symmetric and positive.
    covariance = left @ before.covariance_m2 @ left.T + gain @ noise @ gain.T
    position_m = before.position_m + gain @ (seen.position_m - before.position_m)
    return Estimate(position_m=position_m, covariance_m2=covariance, stamp_ns=seen.stamp_ns)


def mahalanobis2(estimates: list[Estimate], seen: list[Estimate]) -> Array:
    """Return squared Mahalanobis distances, (estimates, seen), 3 degrees of freedom."""
    offsets = (
        np.array([one.position_m for one in seen])[None]
        - (np.array([one.position_m for one in estimates])[:, None])
    )
    spread = (
        np.array([one.covariance_m2 for one in seen])[None]
        + (np.array([one.covariance_m2 for one in estimates])[:, None])
    )
    solved = np.linalg.solve(spread, offsets[..., None])[..., 0]
    distances: Array = np.einsum("ijk,ijk->ij", offsets, solved)
    return distances


def carried(position_m: tuple[float, float, float], stamp_ns: int) -> Estimate:
    """Return what is known of a thing that a hand holds: where the hand is."""
    covariance = CARRIED_SIGMA_M**2 * np.eye(3)
    return Estimate(position_m=np.array(position_m), covariance_m2=covariance, stamp_ns=stamp_ns)


def dropped(estimate: Estimate) -> Estimate:
    """Return what is known of a thing that has fallen from where it was."""
    return replace(estimate, covariance_m2=DROPPED_SIGMA_M**2 * np.eye(3))


def covariance_of(detection: Detection, range_m: float) -> Array:
    """Return the covariance (3, 3) in m^2 of an observation in the map, from `range_m` away."""
    across_m, height_m = math.hypot(FORM_M, POSE_M, POSE_RAD * range_m), FORM_M
    if detection.truncated or detection.occluded:
        hidden_m = max(HIDDEN_M, HIDDEN_OF_SIZE * max(detection.size_m))
        across_m, height_m = math.hypot(across_m, hidden_m), math.hypot(height_m, hidden_m)
    shared = np.diag((across_m**2, across_m**2, height_m**2))
    return np.array(detection.covariance_m2, dtype=np.float64) + shared
