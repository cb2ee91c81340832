"""Tell whether colour, or depth, repeats itself to the bit while the camera moves."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from vla_deploy.navigation.pose import Pose2D
from vla_deploy.perception.frame_statistics import Glance
from vla_deploy.perception.rotation import angle_rad

VIEW_DISTANCE_M: Final = 3.0
"""Driving by one metre changes the view as turning by one over this does."""
MOVED_RAD: Final = 0.01
"""Change of view by which no row that tells stays the same; at rest, pose and joints say less."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Stand:
    """Hold how the camera was turned, 3 x 3, and where the base stood, in a frame without jumps."""

    rotation: NDArray[np.float64]
    base: Pose2D

    def change_rad(self, other: "Stand") -> float:
        """Return by how much the view changes from here to there."""
        driven_m = math.hypot(other.base.x_m - self.base.x_m, other.base.y_m - self.base.y_m)
        return angle_rad(self.rotation.T @ other.rotation) + driven_m / VIEW_DISTANCE_M


class Repeats:
    """Hold the image since when too many rows are the same, and where the camera stood then.

    The view of a robot at rest may repeat itself by right: a row counts only once it has moved.
    """

    def __init__(self, same_ratio: Callable[[Glance, Glance], float], most: float) -> None:
        """Watch a part of the images, of which `most` may be the same."""
        self._same_ratio = same_ratio
        self._most = most
        self._began: tuple[Glance, Stand] | None = None

    def ratio(self, glance: Glance, stand: Stand) -> float:
        """Return the share of rows that are the same, 0 unless the camera moved meanwhile."""
        began, self._began = self._began, (glance, stand)
        if began is None:
            return 0.0
        ratio = self._same_ratio(glance, began[0])
        if ratio > self._most:
            self._began = began
        return ratio if began[1].change_rad(stand) >= MOVED_RAD else 0.0
