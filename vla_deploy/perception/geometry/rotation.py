"""Measure rotations."""

import math

import numpy as np
from numpy.typing import NDArray


def angle_rad(rotation: NDArray[np.float64]) -> float:
    """Return by how much a 3 x 3 rotation turns, whichever way: 0 to pi."""
    cosine = (float(np.trace(rotation)) - 1.0) / 2.0
    return math.acos(min(1.0, max(-1.0, cosine)))
