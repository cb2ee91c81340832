"""Plan paths with A* on the map's clearance: keep away from walls, then cut needless corners."""

import heapq
import math
from dataclasses import replace

import cv2
import numpy as np
from numpy.typing import NDArray

from vla_deploy.navigation.errors import NoPath
from vla_deploy.navigation.maps.distance_field import DistanceField
from vla_deploy.robots import RobotDescription
from vla_deploy.robots.maps.grid_map import GridMap, load_map, with_zones

Cell = tuple[int, int]

# Cells nearer than this to an obstacle cost more, up to WALL_COST times at the least clearance.
COMFORT_M = 0.25
WALL_COST = 4.0
# What a scan shows this near to a blocked cell is that cell: scans and poses are a little off.
MAPPED_M = 0.11
CLEARANCE_MARGIN_M = 0.03
"""Air between the base's footprint and what stands on the map."""
_NEIGHBOURS = tuple(
    (dr, dc, math.hypot(dr, dc)) for dr in (-1, 0, 1) for dc in (-1, 0, 1) if dr or dc
)


def clearance_of(grid: GridMap) -> NDArray[np.float32]:
    """Return each cell's distance in metres to the nearest cell that is not free, or not mapped."""
    free = np.pad((~grid.blocked).astype(np.uint8), 1)  # nobody knows what is off the map
    cells: NDArray[np.float32] = cv2.distanceTransform(free, cv2.DIST_L2, 5).astype(np.float32)
    return cells[1:-1, 1:-1] * np.float32(grid.resolution_m)


class PathPlanner:
    """Plan on one map for one body; `body_radius_m` is the clearance that every path keeps."""

    def __init__(self, grid: GridMap, body_radius_m: float) -> None:
        self._grid = grid
        self._radius_m = body_radius_m
        self.clearance_m = clearance_of(grid)
        """Each cell's distance to what blocks."""
        near = np.clip((body_radius_m + COMFORT_M - self.clearance_m) / COMFORT_M, 0.0, 1.0)
        self._cost = 1.0 + (WALL_COST - 1.0) * near
        # The search runs on one list of cells with a border around the map, so that it need not
        # look for the edge: the cost per cell of way, infinite where the body does not fit.
        fits = self.clearance_m >= body_radius_m
        tolls = np.pad(np.where(fits, self._cost, np.inf), 1, constant_values=np.inf)
        self._stride = int(tolls.shape[1])
        self._tolls: list[float] = tolls.ravel().tolist()

    def is_free(self, x_m: float, y_m: float) -> bool:
        """Return whether the body fits at a point of the map frame."""
        return self.room_m(x_m, y_m) >= self._radius_m

    def room_m(self, x_m: float, y_m: float) -> float:
        """Return the distance from a point of the map frame to what blocks; 0 off the map."""
        cell = self._grid.world_to_cell(x_m, y_m)
        return float(self.clearance_m[cell]) if self._inside(cell) else 0.0

    def is_mapped(self, points: NDArray[np.float64]) -> NDArray[np.bool_]:
        """Return which of (n, 2) points of the map frame the map shows as blocked, or nearly."""
        grid = self._grid
        clearance = DistanceField(self.clearance_m, grid.resolution_m, grid.origin_m)
        near_m = clearance.nearest(points)
        return (near_m < MAPPED_M) | np.isinf(near_m)

    def around(self, points: NDArray[np.float64], aside_m: float) -> "PathPlanner":
        """Return a planner that keeps `aside_m` more than its clearance from (n, 2) map points."""
        grid, blocked = self._grid, self._grid.blocked.astype(np.uint8)
        radius = max(1, round(aside_m / grid.resolution_m))
        for x_m, y_m in points.tolist():
            row, column = grid.world_to_cell(x_m, y_m)
            cv2.circle(blocked, (column, row), radius, 1, thickness=cv2.FILLED)
        return PathPlanner(replace(grid, blocked=blocked.astype(np.bool_)), self._radius_m)

    @property
    def grid(self) -> GridMap:
        """Return the map that is planned on."""
        return self._grid

    @property
    def radius_m(self) -> float:
        """Return the clearance that every path keeps."""
        return self._radius_m

    def plan(self, start: tuple[float, float], goal: tuple[float, float]) -> NDArray[np.float64]:
        """Return the way from start to goal as (n, 2) points in the map frame.

        A start too close to a wall is left by the shortest way out.

        Raises:
            NoPath: the goal is off the map or too tight, or nothing leads there.
        """
        start_cell, goal_cell = self._grid.world_to_cell(*start), self._grid.world_to_cell(*goal)
        if not self._inside(goal_cell) or self.clearance_m[goal_cell] < self._radius_m:
            raise NoPath(
                f"the goal {goal[0]:.2f}, {goal[1]:.2f} m leaves less than the "
                f"{self._radius_m:.2f} m of clearance that the body needs; choose another point"
            )
        if not self._inside(start_cell):
            raise NoPath(f"the robot stands off the map at {start[0]:.2f}, {start[1]:.2f} m")
        cells = self._search(self._way_out(start_cell), goal_cell)
        if cells is None:
            raise NoPath(f"nothing leads from {start} to {goal} with {self._radius_m:.2f} m around")
        centres = np.array([self._grid.cell_to_world(*cell) for cell in self._shortcut(cells)])
        centres[-1] = goal
        return np.vstack((start, centres[1:] if start_cell == cells[0] else centres))

    def _inside(self, cell: Cell) -> bool:
        rows, columns = self.clearance_m.shape
        return bool(0 <= cell[0] < rows and 0 <= cell[1] < columns)

    def _way_out(self, cell: Cell) -> Cell:
        if self.clearance_m[cell] >= self._radius_m:
            return cell
        rows, columns = np.nonzero(self.clearance_m >= self._radius_m)
        if not rows.size:
            raise NoPath("the map has no place where the body fits")
        nearest = int(np.argmin((rows - cell[0]) ** 2 + (columns - cell[1]) ** 2))
        return int(rows[nearest]), int(columns[nearest])

    def _search(self, start: Cell, goal: Cell) -> list[Cell] | None:
        stride, tolls = self._stride, self._tolls
        neighbours = [(dr * stride + dc, length) for dr, dc, length in _NEIGHBOURS]
        first, last = self._number(start), self._number(goal)
        end = divmod(last, stride)
        came_from: dict[int, int] = {}
        cost_so_far = {first: 0.0}
        done: set[int] = set()
        frontier: list[tuple[float, int]] = [(0.0, first)]
        while frontier:
            cell = heapq.heappop(frontier)[1]
            if cell == last:
                return [self._cell(number) for number in _unwind(came_from, cell)]
            if cell in done:
                continue
            done.add(cell)
            cost_here = cost_so_far[cell]
            for offset, length in neighbours:
                following = cell + offset
                cost = cost_here + length * tolls[following]
                if cost < cost_so_far.get(following, math.inf):
                    cost_so_far[following] = cost
                    came_from[following] = cell
                    ahead = math.dist(divmod(following, stride), end)
                    heapq.heappush(frontier, (cost + ahead, following))
        return None

    def _number(self, cell: Cell) -> int:
        return (cell[0] + 1) * self._stride + cell[1] + 1

    def _cell(self, number: int) -> Cell:
        row, column = divmod(number, self._stride)
        return row - 1, column - 1

    def _shortcut(self, cells: list[Cell]) -> list[Cell]:
        """Drop cells while the straight line costs no more than the way along them."""
        kept, anchor = [cells[0]], 0
        for index in range(2, len(cells)):
            along = sum(
                math.dist(a, b) * float(self._cost[b])
                for a, b in zip(cells[anchor:index], cells[anchor + 1 : index + 1], strict=True)
            )
            if self._line_cost(cells[anchor], cells[index]) > along + 1e-6:
                anchor = index - 1
                kept.append(cells[anchor])
        return [*kept, cells[-1]] if cells[-1] != kept[-1] else kept

    def _line_cost(self, start: Cell, end: Cell) -> float:
        length = math.dist(start, end)
        samples = np.linspace(start, end, max(2, math.ceil(2 * length)))
        rows, columns = np.rint(samples).astype(np.intp).T
        if (self.clearance_m[rows, columns] < self._radius_m).any():
            return math.inf
        return length * float(self._cost[rows, columns].mean())


def _unwind(came_from: dict[int, int], cell: int) -> list[int]:
    cells = [cell]
    while cell in came_from:
        cell = came_from[cell]
        cells.append(cell)
    return cells[::-1]


class NoWays(PathPlanner):
    """Answer for a robot that stands fixed: no way leads anywhere."""

    def __init__(self, name: str) -> None:
        """Take the robot's name, which says why."""
        self._reason = f"{name} has no base: it stays where it is mounted"

    def is_free(self, x_m: float, y_m: float) -> bool:
        """Return that the robot cannot stand there."""
        return False

    def is_mapped(self, points: NDArray[np.float64]) -> NDArray[np.bool_]:
        """Return that there is no map that shows them."""
        return np.zeros(len(points), dtype=np.bool_)

    def plan(self, start: tuple[float, float], goal: tuple[float, float]) -> NDArray[np.float64]:
        """Find no way.

        Raises:
            NoPath: always.
        """
        raise NoPath(self._reason)

    def room_m(self, x_m: float, y_m: float) -> float:
        """Return that there is no room."""
        return 0.0


class OpenFloor(NoWays):
    """Answer for a base without a map: it may stand anywhere, and finds its way nowhere."""

    def __init__(self, name: str) -> None:
        """Take the robot's name, which says why."""
        self._reason = (
            f"{name} has no lidar: it does not know its place on a map, and drives by distances "
            "and turns only"
        )

    def is_free(self, x_m: float, y_m: float) -> bool:
        """Return that nothing is known against it."""
        return True

    def room_m(self, x_m: float, y_m: float) -> float:
        """Return that nothing is known to be near."""
        return math.inf


def base_planner(robot: RobotDescription) -> PathPlanner:
    """Return the planner for a robot's base on its own map, around its keep-out zones.

    That of a robot without a base, or without a map, finds no way.

    Raises:
        MapInvalid: the robot file's map cannot be used.
    """
    if robot.parts.base is None:
        return NoWays(robot.name)
    if robot.parts.home is None:
        return OpenFloor(robot.name)
    grid = with_zones(load_map(robot.home.map_path), robot.home.zones)
    return PathPlanner(grid, robot.base.footprint_radius_m + CLEARANCE_MARGIN_M)
