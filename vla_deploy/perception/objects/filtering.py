"""Filter a thing's position: what was known, what a sight adds, and how sure both are.

Things stand still until something moves them. So the model is a place with a covariance that grows
slowly while nobody looks (somebody may have nudged it), not a velocity that would carry a noisy
sight away. What was moved, and what a hand carries, is seated anew instead: its past says nothing.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from drivers.clock import NS_PER_S

Array = NDArray[np.float64]

# In one second of not looking; 0.12 m after half an hour.
DRIFT_M2_S = 0.003**2
MOST_SIGMA_M = 0.15
CARRIED_SIGMA_M = 0.03
# What falls from a hand rolls away, and ends somewhere between the hand and the floor.
DROPPED_SIGMA_M = 0.25


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


def grown(estimate: Estimate, stamp_ns: int) -> Estimate:
    """Return what is known at a later moment: the same place, less surely, up to a bound."""
    age_s = max(0.0, (stamp_ns - estimate.stamp_ns) / NS_PER_S)
    room_m2 = max(0.0, MOST_SIGMA_M**2 - float(np.max(np.diag(estimate.covariance_m2))))
    growth_m2 = min(DRIFT_M2_S * age_s, room_m2)
    return Estimate(
        position_m=estimate.position_m,
        covariance_m2=estimate.covariance_m2 + growth_m2 * np.eye(3),
        stamp_ns=max(stamp_ns, estimate.stamp_ns),
    )


def corrected(estimate: Estimate, seen: Estimate, looks: float = 1.0) -> Estimate:
    """Return what is known after a sight of a thing that stood still.

    `looks` is how many sights like this one, wrong in the same way, say no more than one.
    """
    before, noise = grown(estimate, seen.stamp_ns), looks * seen.covariance_m2
    gain = before.covariance_m2 @ np.linalg.inv(before.covariance_m2 + noise)
    left = np.eye(3) - gain
    # Joseph's form stays symmetric and positive.
    covariance = left @ before.covariance_m2 @ left.T + gain @ noise @ gain.T
    position_m = before.position_m + gain @ (seen.position_m - before.position_m)
    return Estimate(position_m=position_m, covariance_m2=covariance, stamp_ns=seen.stamp_ns)


def distances2(estimates: list[Estimate], seen: list[Estimate]) -> Array:
    """Return squared Mahalanobis distances, (estimates, sights): 3 degrees of freedom each."""
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
    covariance = DROPPED_SIGMA_M**2 * np.eye(3)
    return Estimate(
        position_m=estimate.position_m, covariance_m2=covariance, stamp_ns=estimate.stamp_ns
    )
