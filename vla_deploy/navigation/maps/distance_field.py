"""Know the distance to the nearest wall everywhere, to match scans with it and to cast rays."""

from typing import Final

import cv2
import numpy as np
from numpy.typing import NDArray

from vla_deploy.navigation.localising.scan import ScanPoints
from vla_deploy.navigation.maps.cell_window import CellWindow
from vla_deploy.robots.floor_pose import Points
from vla_deploy.robots.maps.grid_map import GridMap

Floats = NDArray[np.float64]

_MAX_STRIDES: Final = 64
_LONGEST_STRIDE_M: Final = 1.0
# Known before the surface and, less far, behind it: walls are thin, and seen from both sides.
BEFORE_M: Final = 0.25
BEHIND_M: Final = 0.06
MOST_WEIGHT: Final = 200.0
FIELD, WEIGHT = "field", "weight"


class DistanceField:
    """Hold the signed distance to the nearest wall's surface (negative inside it) and its slope."""

    def __init__(
        self, cells_m: NDArray[np.float32], resolution_m: float, origin_m: tuple[float, float]
    ) -> None:
        """Take the distance at each cell's centre; `origin_m` is the corner of cell (0, 0)."""
        self.resolution_m = resolution_m
        self.origin_m = origin_m
        self.cells_m = cells_m

    @classmethod
    def of(cls, grid: GridMap) -> "DistanceField":
        """Return the field of what the lidar sees of a map."""
        occupied = grid.walls.astype(np.uint8)
        outside = cv2.distanceTransform(1 - occupied, cv2.DIST_L2, cv2.DIST_MASK_PRECISE)
        inside = cv2.distanceTransform(occupied, cv2.DIST_L2, cv2.DIST_MASK_PRECISE)
        # Distances run between cell centres; the surface lies half a cell before the next one.
        cells = np.where(occupied > 0, 0.5 - inside, outside - 0.5)
        return cls((cells * grid.resolution_m).astype(np.float32), grid.resolution_m, grid.origin_m)

    def sample(self, points: Points) -> tuple[Floats, Points]:
        """Return distance and gradient at (n, 2) map points, by bilinear interpolation."""
        rows, columns = self.cells_m.shape
        at = (points - self.origin_m) / self.resolution_m - 0.5
        u = np.clip(at[:, 0], 0.0, columns - 1.001)
        v = np.clip(at[:, 1], 0.0, rows - 1.001)
        i, j = v.astype(np.intp), u.astype(np.intp)
        fu, fv = u - j, v - i
        # Clipped as they are, both have a neighbour: in one flat list it lies a cell or a row on.
        field_m, cell = self.cells_m.ravel(), i * columns + j
        low, high = field_m.take(cell), field_m.take(cell + 1)
        low_next, high_next = field_m.take(cell + columns), field_m.take(cell + columns + 1)
        along_low, along_high = low + fu * (high - low), low_next + fu * (high_next - low_next)
        gradient_x = (1.0 - fv) * (high - low) + fv * (high_next - low_next)
        gradient = np.column_stack((gradient_x, along_high - along_low))
        return along_low + fv * (along_high - along_low), gradient / self.resolution_m

    def nearest(self, points: Points) -> NDArray[np.float32]:
        """Return the distance of the cell that each of (n, 2) points is in; endless off the map."""
        rows, columns = self.cells_m.shape
        at = np.floor((points - self.origin_m) / self.resolution_m).astype(np.intp)
        inside = (at[:, 0] >= 0) & (at[:, 0] < columns) & (at[:, 1] >= 0) & (at[:, 1] < rows)
        cell = np.where(inside, at[:, 1] * columns + at[:, 0], 0)
        return np.where(inside, self.cells_m.ravel().take(cell), np.float32(np.inf))

    def cast(self, starts: Points, directions: Points, reach_m: Floats) -> Floats:
        """Return how far each ray gets before it meets a wall, at most `reach_m`.

        Each stride is as long as the field says that nothing is near. `directions` are of length 1.
        """
        travelled_m = np.zeros(len(starts))
        least_m = 0.5 * self.resolution_m
        going = np.arange(len(starts))
        for _ in range(_MAX_STRIDES):
            at = starts[going] + travelled_m[going, None] * directions[going]
            near_m = self.nearest(at)
            on = (near_m > 0.0) & (travelled_m[going] < reach_m[going])
            going = going[on]
            if not going.size:
                break
            # The point may lie nearer to the wall than the middle of its cell.
            travelled_m[going] += np.clip(near_m[on] - least_m, least_m, _LONGEST_STRIDE_M)
        return np.minimum(travelled_m, reach_m)


class SurfaceField:
    """Grow a field from scans, exact to a fraction of a cell.

    An occupancy grid knows a wall to its cell only; here each cell keeps the mean of what all beams
    said of its distance to the surface, and the surface lies where that is zero. Unknown cells are
    as far from a surface as the field can hold.
    """

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
        beams, _ = scan.beams()
        slant = np.clip((beams * scan.surface_normals()).sum(axis=1), 0.1, 1.0)
        offsets_m = np.arange(-BEFORE_M, BEHIND_M + 1e-9, 0.5 * resolution_m)
        points = (scan.ends[:, None] + offsets_m[None, :, None] * beams[:, None]).reshape(-1, 2)
        distance_m = (-offsets_m[None, :] * slant[:, None]).ravel()
        self._window.cover(points)
        self._average(points, distance_m)

    def is_known(self, points: Points) -> NDArray[np.bool_]:
        """Return at which of (n, 2) points the field knows a surface near."""
        window = self._window
        if not window.shape[0]:
            return np.zeros(len(points), dtype=np.bool_)
        weight = DistanceField(window.layers[WEIGHT], window.resolution_m, window.origin_m)
        known = weight.nearest(points)
        return np.asarray((known > 0.0) & np.isfinite(known))

    def _average(self, points: Points, distance_m: Floats) -> None:
        window = self._window
        index, size = window.flat_index(points), window.shape[0] * window.shape[1]
        count = np.bincount(index, minlength=size)
        total = np.bincount(index, weights=distance_m, minlength=size)
        field, weight = window.layers[FIELD].ravel(), window.layers[WEIGHT].ravel()
        seen = np.flatnonzero(count)
        mean = total[seen] / count[seen]
        field[seen] = (field[seen] * weight[seen] + mean) / (weight[seen] + 1.0)
        weight[seen] = np.minimum(weight[seen] + 1.0, MOST_WEIGHT)
