"""Grow a signed distance field from scans, exact to a fraction of a cell, to match scans with.

An occupancy grid knows a wall to its cell only; here each cell keeps the mean of what all beams
said of its distance to the surface, and the surface lies where that is zero.
"""

from typing import Final

import numpy as np

from vla_deploy.navigation.localising.scan_match import ScanPoints
from vla_deploy.navigation.maps.cell_window import CellWindow
from vla_deploy.navigation.maps.distance_field import DistanceField
from vla_deploy.navigation.maps.occupancy import surface_normals
from vla_deploy.robots.floor_pose import Points

# Known before the surface and, less far, behind it: walls are thin, and seen from both sides.
BEFORE_M: Final = 0.25
BEHIND_M: Final = 0.06
MOST_WEIGHT: Final = 200.0
FIELD, WEIGHT = "field", "weight"


class SurfaceField:
    """Hold the field; unknown cells are as far from a surface as the field can tell."""

    def __init__(self, resolution_m: float) -> None:
        self._window = CellWindow(resolution_m, {FIELD: BEFORE_M, WEIGHT: 0.0})

    @property
    def field(self) -> DistanceField:
        """Return the field as scans are matched with it."""
        window = self._window
        return DistanceField(window.layers[FIELD], window.resolution_m, window.origin_m)

    def add(self, scan: ScanPoints) -> None:
        """Take in a scan in the map frame; its points must be in the order of the beams."""
        resolution_m = self._window.resolution_m
        ways = scan.ends - scan.starts
        beams = ways / np.maximum(np.hypot(ways[:, 0], ways[:, 1]), 1e-9)[:, None]
        slant = np.clip((beams * surface_normals(scan)).sum(axis=1), 0.1, 1.0)
        offsets_m = np.arange(-BEFORE_M, BEHIND_M + 1e-9, 0.5 * resolution_m)
        points = (scan.ends[:, None] + offsets_m[None, :, None] * beams[:, None]).reshape(-1, 2)
        distance_m = (-offsets_m[None, :] * slant[:, None]).ravel()
        self._window.cover(points)
        self._average(points, distance_m)

    def is_known(self, points: Points) -> np.ndarray:
        """Return at which of (n, 2) points the field knows a surface near."""
        window = self._window
        if not window.shape[0]:
            return np.zeros(len(points), dtype=np.bool_)
        weight = DistanceField(window.layers[WEIGHT], window.resolution_m, window.origin_m)
        known = weight.nearest(points)
        return np.asarray((known > 0.0) & np.isfinite(known))

    def _average(self, points: Points, distance_m: np.ndarray) -> None:
        window = self._window
        index, size = window.flat_index(points), window.shape[0] * window.shape[1]
        count = np.bincount(index, minlength=size)
        total = np.bincount(index, weights=distance_m, minlength=size)
        field, weight = window.layers[FIELD].ravel(), window.layers[WEIGHT].ravel()
        seen = np.flatnonzero(count)
        mean = total[seen] / count[seen]
        field[seen] = (field[seen] * weight[seen] + mean) / (weight[seen] + 1.0)
        weight[seen] = np.minimum(weight[seen] + 1.0, MOST_WEIGHT)
