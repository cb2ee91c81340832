"""Build and measure rotations."""

import math

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def angle_rad(rotation: Array) -> float:
    """Return by how much a 3 x 3 rotation turns, whichever way: 0 to pi."""
    cosine = (float(np.trace(rotation)) - 1.0) / 2.0
    return math.acos(min(1.0, max(-1.0, cosine)))


def yaw_rotation(yaw_rad: float) -> Array:
    """Return the 3 x 3 rotation about the vertical axis."""
    c, s = math.cos(yaw_rad), math.sin(yaw_rad)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
