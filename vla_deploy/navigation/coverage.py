"""Lead a body over all of a floor: in lanes, and then to what they have left."""

import math
from collections.abc import Iterator, Sequence
from typing import Final

import cv2
import numpy as np
from numpy.typing import NDArray

from vla_deploy.navigation.errors import NoPath
from vla_deploy.navigation.path_planning import CLEARANCE_MARGIN_M, PathPlanner
from vla_deploy.robots.floor_pose import Points
from vla_deploy.robots.maps.grid_map import GridMap

Mask = NDArray[np.bool_]
Lane = tuple[Points, Points]

OVERLAP_RATIO: Final = 0.8
"""Of the body's width from lane to lane: tracking is a few centimetres off."""
SHORTEST_M: Final = 0.1


class FloorCoverage:
    """Hold over which of a floor a round body can get, and over which it has been."""

    def __init__(self, planner: PathPlanner, corners_m: Sequence[tuple[float, float]]) -> None:
        """Take the corners of the floor in the map frame.

        Raises:
            NoPath: the body fits nowhere on it.
        """
        grid = self._grid = planner.grid
        self._reach = max(1, round((planner.radius_m - CLEARANCE_MARGIN_M) / grid.resolution_m))
        self._centres = _within(grid, corners_m) & (planner.clearance_m >= planner.radius_m)
        if not self._centres.any():
            raise NoPath("the map shows no free floor there that the body fits on")
        self._floor = _widened(self._centres, self._reach) & ~grid.blocked
        self._covered = np.zeros_like(self._floor)

    @property
    def area_m2(self) -> float:
        """Return how much floor the body can get over."""
        return float(self._floor.sum()) * self._grid.resolution_m**2

    @property
    def covered_ratio(self) -> float:
        """Return over which share of that it has been."""
        return float((self._covered & self._floor).sum() / self._floor.sum())

    def pass_over(self, x_m: float, y_m: float) -> None:
        """Note where the body is."""
        row, column = self._grid.world_to_cell(x_m, y_m)
        spot = np.zeros(self._covered.shape, dtype=np.uint8)
        cv2.circle(spot, (column, row), self._reach, 1, thickness=cv2.FILLED)
        self._covered |= spot.astype(np.bool_)

    def lanes(self, here: tuple[float, float]) -> Iterator[Lane]:
        """Yield lanes across the room, each from its nearer end, the next one the nearest left."""
        left, at = self._all_lanes(), np.array(here)
        while left:
            ends = [
                (math.dist(lane[end], at), number, end)
                for number, lane in enumerate(left)
                for end in (0, 1)
            ]
            _, number, end = min(ends)
            lane = left.pop(number)
            start, at = lane[end], lane[1 - end]
            yield start, at

    def missed(self, here: tuple[float, float]) -> Points | None:
        """Return the nearest point from which uncovered floor is covered; None if none is left."""
        left = self._floor & ~self._covered
        near = _widened(left, self._reach - 1) & self._centres
        if not near.any():
            return None
        points = np.array([self._grid.cell_to_world(*cell) for cell in np.argwhere(near).tolist()])
        nearest: Points = points[int(np.argmin(np.hypot(*(points - here).T)))]
        return nearest

    def leave_out(self, x_m: float, y_m: float) -> None:
        """Send the body to that very spot no more, whether it has got there or not."""
        row, column = self._grid.world_to_cell(x_m, y_m)
        self._centres[max(0, row - 1) : row + 2, max(0, column - 1) : column + 2] = False

    def _all_lanes(self) -> list[Lane]:
        rows, columns = np.nonzero(self._centres)
        across = np.ptp(rows) > np.ptp(columns)  # along the longer side
        centres = self._centres.T if across else self._centres
        stride = max(1, round(2.0 * OVERLAP_RATIO * self._reach))
        used = np.flatnonzero(centres.any(axis=1))
        lanes = []
        for line in [*range(int(used[0]), int(used[-1]), stride), int(used[-1])]:
            for first, last in _runs(centres[line]):
                cells = ((first, line), (last, line)) if across else ((line, first), (line, last))
                start, end = (np.array(self._grid.cell_to_world(*cell)) for cell in cells)
                if math.dist(start, end) >= SHORTEST_M:
                    lanes.append((start, end))
        return lanes


def _runs(line: Mask) -> list[tuple[int, int]]:
    """Return the first and last place of each run of trues."""
    edges = np.flatnonzero(np.diff(np.concatenate(([False], line, [False])).astype(np.int8)))
    return [(int(first), int(after) - 1) for first, after in edges.reshape(-1, 2)]


def _widened(mask: Mask, cells: int) -> Mask:
    size = 2 * max(0, cells) + 1
    disc = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (size, size))
    wide: Mask = cv2.dilate(mask.astype(np.uint8), disc).astype(np.bool_)
    return wide


def _within(grid: GridMap, corners_m: Sequence[tuple[float, float]]) -> Mask:
    inside = np.zeros(grid.blocked.shape, dtype=np.uint8)
    cells = [grid.world_to_cell(x_m, y_m)[::-1] for x_m, y_m in corners_m]
    cv2.fillPoly(inside, [np.array(cells, dtype=np.int32)], 1)
    return inside.astype(np.bool_)
