"""Tell whether colours repeat themselves to the bit while the camera moves."""

import math
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from drivers.clock import NS_PER_S
from vla_deploy.navigation.pose import Pose2D
from vla_deploy.perception.geometry.rotation import angle_rad
from vla_deploy.perception.images.frame_statistics import Glance

VIEW_DISTANCE_M: Final = 3.0
"""Driving by one metre changes the view as turning by one over this does."""
MOVED_RAD: Final = 0.01
"""Change of view by which rows with contrast change; at rest, pose and joints say less."""
REST_NS: Final = 20 * NS_PER_S
"""A change of view of less than `MOVED_RAD` in this time is none: dead reckoning drifts."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class CameraStand:
    """Hold how the camera was turned, 3 x 3, and where the base stood, in a frame without jumps."""

    stamp_ns: int
    rotation: NDArray[np.float64]
    base: Pose2D

    def change_rad(self, other: "CameraStand") -> float:
        """Return by how much the view changes from here to there."""
        driven_m = math.hypot(other.base.x_m - self.base.x_m, other.base.y_m - self.base.y_m)
        return angle_rad(self.rotation.T @ other.rotation) + driven_m / VIEW_DISTANCE_M


class Travel:
    """Add up by how much the view has changed since a stand; at rest nothing is added."""

    def __init__(self, began: CameraStand) -> None:
        self._from = began
        self._before_rad = 0.0

    def rad(self, stand: CameraStand) -> float:
        """Return the change of view up to a stand."""
        change_rad = self._from.change_rad(stand)
        moved_rad = self._before_rad + change_rad
        if stand.stamp_ns - self._from.stamp_ns >= REST_NS:
            if change_rad >= MOVED_RAD:
                self._before_rad = moved_rad
            self._from = stand
        return moved_rad


class Repeats:
    """Hold the image since when too many rows of colour are the same, and where the camera stood.

    What a robot at rest sees may repeat itself by right: a row counts only once the camera moved.
    """

    def __init__(self, most: float) -> None:
        """Watch images of which a share of at most `most` may be the same."""
        self._most = most
        self._began: tuple[Glance, Travel] | None = None

    def ratio(self, glance: Glance, stand: CameraStand) -> float:
        """Return the share of rows that are the same, 0 unless the camera moved meanwhile."""
        began, self._began = self._began, (glance, Travel(stand))
        if began is None:
            return 0.0
        ratio = glance.stale_colour_ratio(began[0])
        if ratio > self._most:
            self._began = began
        return ratio if began[1].rad(stand) >= MOVED_RAD else 0.0
