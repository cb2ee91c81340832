"""Know the distance to the nearest wall everywhere, to match scans with it and to cast rays."""

import cv2
import numpy as np
from numpy.typing import NDArray

from vla_deploy.navigation.maps.grid_map import GridMap
from vla_deploy.robots.floor_pose import Points

Floats = NDArray[np.float64]

_MAX_STRIDES = 64
_LONGEST_STRIDE_M = 1.0


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
