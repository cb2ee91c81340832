import math

import numpy as np
import pytest

from vla_deploy.navigation.coverage import FloorCoverage
from vla_deploy.navigation.errors import NoPath
from vla_deploy.navigation.path_planning import PathPlanner
from vla_deploy.robots.maps.grid_map import GridMap

RADIUS_M = 0.25
CORNERS = [(0.0, 0.0), (3.0, 0.0), (3.0, 2.0), (0.0, 2.0)]
HERE = (0.5, 0.5)


@pytest.fixture
def planner() -> PathPlanner:
    """Two rooms of 3 x 2 m side by side, with a table in the first one."""
    blocked = np.zeros((40, 120), dtype=bool)
    blocked[[0, -1], :] = blocked[:, [0, -1]] = True
    blocked[:30, 60] = True
    blocked[16:24, 25:35] = True
    return PathPlanner(GridMap(resolution_m=0.05, origin_m=(0.0, 0.0), blocked=blocked), RADIUS_M)


def drive(floor: FloorCoverage, start: np.ndarray, end: np.ndarray) -> None:
    for share in np.linspace(0.0, 1.0, 60):
        floor.pass_over(*(start + share * (end - start)))


def test_lanes_and_then_what_they_left_cover_the_floor_of_one_room(planner: PathPlanner) -> None:
    floor, here = FloorCoverage(planner, CORNERS), HERE
    assert floor.covered_ratio == 0.0
    lanes = list(floor.lanes(here))
    assert math.dist(lanes[0][0], here) < 0.6, "the nearest first"
    for start, end in lanes:
        for point in (start, end):
            assert planner.is_free(*point)
            assert point[0] < CORNERS[1][0] + planner.grid.resolution_m
        drive(floor, start, end)
    by_lanes = floor.covered_ratio
    assert by_lanes > 0.8
    for _ in range(30):
        spot = floor.missed(here)
        if spot is None:
            break
        drive(floor, spot, spot)
        floor.leave_out(*spot)
        here = (spot[0], spot[1])
    assert floor.covered_ratio > max(0.96, by_lanes)


def test_a_floor_on_which_the_body_fits_nowhere_is_refused(planner: PathPlanner) -> None:
    with pytest.raises(NoPath, match="no free floor"):
        FloorCoverage(planner, [(1.3, 0.85), (1.7, 0.85), (1.7, 1.15), (1.3, 1.15)])
