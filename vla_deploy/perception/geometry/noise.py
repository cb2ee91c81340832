"""Say how far off a sight's place in the map may be: its own error, and what all sights share.

To what the estimate says of itself come the robot's pose and what a model of a thing's form leaves
out. Those stay the same from image to image, so no number of looks averages them away.
"""

import math

import numpy as np
from numpy.typing import NDArray

from vla_deploy.perception.images.detection import Detection

Array = NDArray[np.float64]

POSE_M, POSE_RAD = 0.008, 0.006
FORM_M = 0.006
# Of a half-hidden thing one does not know where its middle is, whatever is estimated.
HIDDEN_M, HIDDEN_OF_SIZE = 0.03, 0.125


def covariance_of(detection: Detection, range_m: float) -> Array:
    """Return the covariance (3, 3) in m^2 of a sight in the map, from `range_m` away."""
    across_m, height_m = math.hypot(FORM_M, POSE_M, POSE_RAD * range_m), FORM_M
    if detection.truncated or detection.occluded:
        hidden_m = max(HIDDEN_M, HIDDEN_OF_SIZE * max(detection.size_m))
        across_m, height_m = math.hypot(across_m, hidden_m), math.hypot(height_m, hidden_m)
    shared = np.diag((across_m**2, across_m**2, height_m**2))
    return np.array(detection.covariance_m2, dtype=np.float64) + shared
