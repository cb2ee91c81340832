"""Gather what scans and depth images show into an occupancy grid of log-odds.

A scan's beam makes the cells that it crosses likelier to be free and the one that it ends in
likelier to be occupied. Depth images do the same for what stands above or below the lidar's plane.
"""

from typing import Final

import numpy as np
from numpy.typing import NDArray

from vla_deploy.navigation.localising.scan import ScanPoints
from vla_deploy.navigation.maps.cell_window import CellWindow
from vla_deploy.robots.floor_pose import Points
from vla_deploy.robots.maps.map_file import (
    FREE_SHADE,
    LOW_SHADE,
    OCCUPIED_SHADE,
    UNKNOWN_SHADE,
    MapFile,
)

HIT: Final = 0.85
MISS: Final = -0.4
MOST: Final = 6.0
OCCUPIED: Final = 0.6
FREE: Final = -0.7
# Samples along a beam, in cells.
STRIDE: Final = 0.5
LIDAR, DEPTH = "lidar", "depth"


class OccupancyGrid:
    """Hold the log-odds of every cell seen, for the lidar's plane and for the body's height."""

    def __init__(self, resolution_m: float = 0.05) -> None:
        self.window = CellWindow(resolution_m, {LIDAR: 0.0, DEPTH: 0.0})

    def add_scan(self, scan: ScanPoints) -> None:
        """Take in a scan in the map frame; its points must be in the order of the beams."""
        if not len(scan):
            return
        # What is seen begins at the beam's end and goes on behind it: a cell counts as occupied
        # where its middle is, as maps are drawn.
        inside = scan.ends + 0.5 * self.window.resolution_m * scan.surface_normals()
        crossed = self._crossed(scan)
        self.window.cover(np.vstack((inside, crossed)))
        self._vote(LIDAR, hits=inside, misses=crossed)

    def add_depth(self, standing: Points, floor: Points) -> None:
        """Take in where a depth image shows things that stand, and where bare floor, (n, 2)."""
        self.window.cover(np.vstack((standing, floor)))
        self._vote(DEPTH, hits=standing, misses=floor)

    def shades(self) -> NDArray[np.uint8]:
        """Return the grid as a map's image; row 0 is the northernmost."""
        lidar, depth = self.window.layers[LIDAR], self.window.layers[DEPTH]
        shades = np.full(lidar.shape, UNKNOWN_SHADE, dtype=np.uint8)
        shades[lidar < FREE] = FREE_SHADE
        shades[depth > OCCUPIED] = LOW_SHADE
        shades[lidar > OCCUPIED] = OCCUPIED_SHADE
        return np.flipud(shades)

    def map_file(self) -> MapFile:
        """Return the grid as a map in the ROS format, cut to what is known."""
        shades = self.shades()
        known = np.argwhere(shades != UNKNOWN_SHADE)
        if not len(known):
            known = np.zeros((1, 2), dtype=np.intp)
            shades = np.full((1, 1), UNKNOWN_SHADE, dtype=np.uint8)
        (top, left), (bottom, right) = known.min(axis=0), known.max(axis=0)
        corner_x, corner_y = self.window.corner
        south = corner_y + shades.shape[0] - 1 - int(bottom)
        resolution_m = self.window.resolution_m
        return MapFile(
            shades=shades[top : bottom + 1, left : right + 1].copy(),
            resolution_m=resolution_m,
            origin_m=(
                round((corner_x + int(left)) * resolution_m, 6),
                round(south * resolution_m, 6),
            ),
        )

    def _vote(self, layer: str, hits: Points, misses: Points) -> None:
        """Change each cell once, however many points fall on it; a hit outweighs misses."""
        cells = self.window.layers[layer].ravel()
        change = np.zeros(cells.size, dtype=np.float32)
        change[self.window.flat_index(misses)] = MISS
        change[self.window.flat_index(hits)] = HIT
        np.clip(cells + change, -MOST, MOST, out=cells)
        self.window.layers[layer] = cells.reshape(self.window.shape)

    def _crossed(self, scan: ScanPoints) -> Points:
        """Return points along all beams, up to the cell before their ends."""
        resolution_m = self.window.resolution_m
        directions, length_m = scan.beams()
        free_m = np.maximum(0.0, length_m - 0.75 * resolution_m)
        counts = np.ceil(free_m / (STRIDE * resolution_m)).astype(np.intp)
        beam = np.repeat(np.arange(len(counts)), counts)
        number = np.arange(len(beam)) - np.repeat(np.cumsum(counts) - counts, counts)
        way_m = number * (STRIDE * resolution_m)
        crossed: Points = scan.starts[beam] + way_m[:, None] * directions[beam]
        return crossed
