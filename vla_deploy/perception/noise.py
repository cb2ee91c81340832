"""Say how far off a sight's position may be: by distance, and by what is hidden of the thing.

The figures are those of the robot as a whole, camera, calibration and pose together, because the
map is where positions are compared.
"""

import math

import numpy as np
from numpy.typing import NDArray

from vla_deploy.perception.detection import Detection

Array = NDArray[np.float64]

# Across the floor and in height: what is left of a good sight at hand, and what distance adds.
ACROSS_M, HEIGHT_M = 0.010, 0.006
FAR_M_PER_M2 = 0.006
# The robot's own pose.
POSE_M, POSE_RAD = 0.008, 0.006
# Of a half-hidden thing one does not know where its middle is.
HIDDEN_M, HIDDEN_OF_SIZE = 0.03, 0.125


def covariance_of(detection: Detection, range_m: float) -> Array:
    """Return the covariance (3, 3) in m^2 of a sight from `range_m` away, in any level frame."""
    far_m = FAR_M_PER_M2 * range_m**2
    across_m = math.hypot(ACROSS_M + far_m, POSE_M, POSE_RAD * range_m)
    height_m = HEIGHT_M + 0.5 * far_m
    if detection.truncated or detection.occluded:
        hidden_m = max(HIDDEN_M, HIDDEN_OF_SIZE * max(detection.size_m))
        across_m, height_m = math.hypot(across_m, hidden_m), math.hypot(height_m, hidden_m)
    return np.diag((across_m**2, across_m**2, height_m**2))
