"""Know what blocks the robot and what its lidar sees, in square cells of the map frame."""

import math
from collections.abc import Iterable
from dataclasses import dataclass, replace
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from vla_deploy.robots.description import KeepOutZone
from vla_deploy.robots.maps.map_file import MapFile, MapMode, read_map_file

# Black crosses the plane of the lidar; dark grey stands above or below it, like a table top.
LIDAR_THRESH = 0.95


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class GridMap:
    """Hold a map of square cells; row 0 is the southernmost, as y grows with the row.

    `origin_m` is the map-frame position of the outer corner of cell (0, 0). `blocked` marks where
    the robot must not go: occupied and unknown cells. `seen_by_lidar` marks what crosses the
    lidar's plane, for localisation; None means all that is blocked.
    """

    resolution_m: float
    origin_m: tuple[float, float]
    blocked: NDArray[np.bool_]
    seen_by_lidar: NDArray[np.bool_] | None = None

    @property
    def walls(self) -> NDArray[np.bool_]:
        """Return the cells that the lidar sees."""
        return self.blocked if self.seen_by_lidar is None else self.seen_by_lidar

    def world_to_cell(self, x_m: float, y_m: float) -> tuple[int, int]:
        """Return row and column of the cell that holds a point; it may lie off the map."""
        column = math.floor((x_m - self.origin_m[0]) / self.resolution_m)
        row = math.floor((y_m - self.origin_m[1]) / self.resolution_m)
        return row, column

    def cell_to_world(self, row: int, column: int) -> tuple[float, float]:
        """Return x and y of a cell's centre."""
        x_m = self.origin_m[0] + (column + 0.5) * self.resolution_m
        y_m = self.origin_m[1] + (row + 0.5) * self.resolution_m
        return x_m, y_m


def load_map(yaml_path: Path) -> GridMap:
    """Read a map.

    Raises:
        MapInvalid: a file is missing or not readable, or a key is missing or out of range.
    """
    return grid_of(read_map_file(yaml_path))


def grid_of(file: MapFile) -> GridMap:
    """Return what a map means to this robot; a map without pure black has one kind of walls."""
    probability = file.probability()
    shades = np.flipud(file.shades)
    black = shades > 255 * LIDAR_THRESH if file.negate else shades < 255 * (1.0 - LIDAR_THRESH)
    occupied = probability > file.occupied_thresh
    seen = occupied if file.mode is MapMode.RAW else occupied & black
    return GridMap(
        resolution_m=file.resolution_m,
        origin_m=file.origin_m,
        blocked=~(probability < file.free_thresh),
        seen_by_lidar=seen if seen.any() else occupied,
    )


def with_zones(grid: GridMap, zones: Iterable[KeepOutZone]) -> GridMap:
    """Return the map with every keep-out zone blocked."""
    blocked = grid.blocked.astype(np.uint8)
    for zone in zones:
        cells = [grid.world_to_cell(x_m, y_m)[::-1] for x_m, y_m in zone.polygon_m]
        cv2.fillPoly(blocked, [np.array(cells, dtype=np.int32)], 1)
    return replace(grid, blocked=blocked.astype(bool), seen_by_lidar=None)
