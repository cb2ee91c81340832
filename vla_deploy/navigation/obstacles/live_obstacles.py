"""Remember, in cells of the map frame, what stands around the robot and is not on its map.

A cell is kept while it is seen, until a beam is seen to pass through it, or until it is too old:
the robot looks away from a chair while it drives around it.
"""

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from drivers.clock import NS_PER_S
from vla_deploy.navigation.localising.scan import ScanPoints
from vla_deploy.navigation.maps.distance_field import DistanceField
from vla_deploy.navigation.obstacles.movers import Mover, MoverTracks
from vla_deploy.navigation.path_planning import MAPPED_M, clearance_of
from vla_deploy.robots.floor_pose import Points
from vla_deploy.robots.maps.grid_map import GridMap

CELL_M: Final = 0.05
SEEN_WITHIN_M: Final = 3.5
"""Further away an error of the heading puts a wall beside its place on the map."""
HEADING_RAD: Final = 0.02
KEPT_NS: Final = 20 * NS_PER_S
ENOUGH_SCANS: Final = 2
"""One scan alone may show what is not there, such as the edge between two things."""
PASSED_M: Final = 0.12
"""A beam that ends this far behind a cell has passed through it."""
BESIDE_RAD: Final = np.deg2rad(0.75)

Floats = NDArray[np.float64]


@dataclass(slots=True)
class _Sighting:
    stamp_ns: int
    scans: int


class LiveObstacles:
    """Hold what the map does not show; feed it every scan that fits the map."""

    def __init__(self, grid: GridMap) -> None:
        self.movers: tuple[Mover, ...] = ()
        """What moves, as the newest scan shows it."""
        self._mapped = DistanceField(clearance_of(grid), grid.resolution_m, grid.origin_m)
        self._cells: dict[tuple[int, int], _Sighting] = {}
        self._tracks = MoverTracks()

    def see(self, scan: ScanPoints, stamp_ns: int) -> None:
        """Take in a scan in the map frame; its points must be in the order of the beams."""
        directions, length_m = scan.beams()
        self._forget_passed(scan.starts, directions, length_m)
        near = length_m < SEEN_WITHIN_M
        points = scan.ends[near]
        points = points[self._is_unmapped(points, length_m[near])]
        self.movers = self._tracks.see(points, stamp_ns)
        for cell in np.unique(_cells_of(points), axis=0).tolist():
            known = self._cells.setdefault((cell[0], cell[1]), _Sighting(stamp_ns, 0))
            known.stamp_ns, known.scans = stamp_ns, known.scans + 1

    def around(self, at: Points, now_ns: int) -> Points:
        """Return the middles of the cells, (n, 2) in the map, those nearest to `at` first."""
        self._cells = {
            cell: one for cell, one in self._cells.items() if now_ns - one.stamp_ns <= KEPT_NS
        }
        sure = [cell for cell, one in self._cells.items() if one.scans >= ENOUGH_SCANS]
        middles: Points = (np.array(sure, dtype=np.float64).reshape(-1, 2) + 0.5) * CELL_M
        order = np.argsort(np.hypot(*(middles - at).T), kind="stable")
        nearest_first: Points = middles[order]
        return nearest_first

    def left(self, stamp_ns: int) -> Points:
        """Return rows of stamp (ns), x, y: where what moves has been, and is no more."""
        return self._tracks.left(stamp_ns)

    def unmapped(self, points: Points) -> NDArray[np.bool_]:
        """Return which of (n, 2) points of the map frame the map does not show."""
        return self._is_unmapped(points, np.zeros(len(points)))

    def _is_unmapped(self, points: Points, away_m: Floats) -> NDArray[np.bool_]:
        near_m = self._mapped.nearest(points)
        return (near_m > MAPPED_M + HEADING_RAD * away_m) & np.isfinite(near_m)

    def _forget_passed(self, starts: Points, directions: Points, length_m: Floats) -> None:
        """Drop cells through which a beam has gone on to something further away."""
        if not self._cells or not len(starts):
            return
        cells = list(self._cells)
        eye = starts.mean(axis=0)  # the lidar moves by centimetres in a scan
        ways = (np.array(cells, dtype=np.float64) + 0.5) * CELL_M - eye
        away_m = np.hypot(*ways.T)
        bearings = np.arctan2(ways[:, 1], ways[:, 0])
        angles = np.arctan2(directions[:, 1], directions[:, 0])
        order = np.argsort(angles)
        after = np.searchsorted(angles[order], bearings) % len(order)
        gone = np.zeros(len(cells), dtype=np.bool_)
        for beam in (order[after], order[after - 1]):
            aside = np.abs((angles[beam] - bearings + np.pi) % (2.0 * np.pi) - np.pi)
            gone |= (aside < BESIDE_RAD) & (length_m[beam] > away_m + PASSED_M)
        for cell, is_gone in zip(cells, gone, strict=True):
            if is_gone:
                del self._cells[cell]


def _cells_of(points: Points) -> NDArray[np.int64]:
    return np.floor(points / CELL_M).astype(np.int64)
