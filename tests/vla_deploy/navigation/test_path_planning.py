from itertools import pairwise

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from vla_deploy.navigation.errors import NoPath
from vla_deploy.navigation.path_planning import PathPlanner, clearance_of
from vla_deploy.robots.maps.grid_map import GridMap

RADIUS_M = 0.2


def room(*walls: tuple[slice, slice], size: int = 60) -> GridMap:
    """A 6 x 6 m room with 0.1 m cells; walls are slices of rows and columns."""
    blocked = np.zeros((size, size), dtype=bool)
    blocked[[0, -1], :] = blocked[:, [0, -1]] = True
    for wall in walls:
        blocked[wall] = True
    return GridMap(resolution_m=0.1, origin_m=(0.0, 0.0), blocked=blocked)


WALL_WITH_DOOR = (np.s_[1:40, 30], np.s_[52:59, 30])


def length_m(path: np.ndarray) -> float:
    return float(np.linalg.norm(np.diff(path, axis=0), axis=1).sum())


def test_an_open_room_is_crossed_in_a_straight_line() -> None:
    path = PathPlanner(room(), RADIUS_M).plan((1.0, 1.0), (4.0, 5.0))
    assert path[0] == pytest.approx((1.0, 1.0))
    assert path[-1] == pytest.approx((4.0, 5.0))
    assert length_m(path) == pytest.approx(5.0, rel=0.02)


def test_a_door_is_taken_through_its_middle() -> None:
    path = PathPlanner(room(*WALL_WITH_DOOR), RADIUS_M).plan((1.0, 1.0), (5.0, 1.0))
    at_wall = [
        a[1] + (b[1] - a[1]) * (3.05 - a[0]) / (b[0] - a[0])
        for a, b in pairwise(path)
        if a[0] <= 3.05 < b[0]
    ]
    assert at_wall == [pytest.approx(4.6, abs=0.4)]


@settings(max_examples=40, deadline=None)
@given(st.tuples(*[st.floats(0.4, 5.5)] * 4), st.integers(0, 2**31))
def test_no_path_comes_nearer_to_anything_than_the_body_allows(
    ends: tuple[float, ...], seed: int
) -> None:
    grid = room()
    rng = np.random.default_rng(seed)
    for row, column in rng.integers(3, 55, size=(8, 2)):
        grid.blocked[row : row + 4, column : column + 3] = True
    planner = PathPlanner(grid, RADIUS_M)
    assume(planner.is_free(*ends[:2]))
    try:
        path = planner.plan(ends[:2], ends[2:])
    except NoPath:
        return
    clearance_m = clearance_of(grid)
    for a, b in pairwise(path):
        for s in np.linspace(0, 1, 50):
            cell = grid.world_to_cell(*(a + (b - a) * s))
            assert clearance_m[cell] >= RADIUS_M - 0.1  # one cell of rounding


def test_a_closed_room_has_no_path() -> None:
    planner = PathPlanner(room((np.s_[1:59], np.s_[30:31])), RADIUS_M)
    with pytest.raises(NoPath, match="nothing leads"):
        planner.plan((1.0, 1.0), (5.0, 1.0))


@pytest.mark.parametrize("goal", [(3.05, 1.0), (-1.0, 2.0), (0.15, 3.0)])
def test_a_goal_in_a_wall_or_off_the_map_is_refused(goal: tuple[float, float]) -> None:
    with pytest.raises(NoPath, match="clearance"):
        PathPlanner(room(*WALL_WITH_DOOR), RADIUS_M).plan((1.0, 1.0), goal)


def test_a_start_beside_a_wall_is_left_by_the_way_out() -> None:
    path = PathPlanner(room(), RADIUS_M).plan((0.15, 3.0), (4.0, 3.0))
    assert path[0] == pytest.approx((0.15, 3.0))
    assert length_m(path) < 4.2


def test_points_near_blocked_cells_and_off_the_map_count_as_mapped() -> None:
    planner = PathPlanner(room((np.s_[20:30], np.s_[20:30])), RADIUS_M)
    points = np.array([[2.5, 2.5], [3.05, 2.5], [3.5, 2.5], [-1.0, 2.5], [2.5, 99.0]])
    assert planner.is_mapped(points).tolist() == [True, True, False, True, True]


def test_room_is_the_distance_to_what_blocks_and_none_off_the_map() -> None:
    planner = PathPlanner(room((np.s_[20:30], np.s_[20:30])), RADIUS_M)
    assert planner.room_m(4.05, 2.45) == pytest.approx(1.1, abs=0.06)
    assert planner.room_m(2.45, 2.45) == 0.0
    assert planner.room_m(-1.0, 2.0) == 0.0


def test_a_body_does_not_fit_where_it_would_stand_over_the_rim_of_the_map() -> None:
    open_field = GridMap(
        resolution_m=0.1, origin_m=(0.0, 0.0), blocked=np.zeros((60, 60), dtype=bool)
    )
    planner = PathPlanner(open_field, RADIUS_M)
    assert planner.is_free(3.0, 3.0)
    assert not planner.is_free(0.05, 3.0)
    assert not planner.is_free(3.0, 5.95)
