import numpy as np
import pytest

from vla_deploy.navigation.obstacles import is_blocked, scan_points

RADIUS_M = 0.24
REACH_M = 0.3


def blocked(x_m: float, y_m: float, *, mapped: bool = False, reach_m: float = REACH_M) -> bool:
    points = np.array([[x_m, y_m]])
    return is_blocked(points, np.array([mapped]), reach_m=reach_m, radius_m=RADIUS_M)


def test_a_scan_becomes_points_without_the_beams_that_saw_nothing() -> None:
    ranges = np.zeros(360)
    ranges[0], ranges[90], ranges[270] = 1.0, 2.0, 3.0
    assert scan_points(ranges) == pytest.approx(np.array([[1.0, 0.0], [0.0, 2.0], [0.0, -3.0]]))


@pytest.mark.parametrize(
    ("point", "expected"),
    [
        ((0.50, 0.00), True),
        ((0.60, 0.00), False),
        ((-0.30, 0.00), False),
        ((0.40, 0.26), True),
        ((0.40, 0.30), False),
        # The body is round: what its edge only reaches later is no obstacle yet.
        ((0.50, 0.27), False),
    ],
)
def test_what_stands_in_the_strip_ahead_blocks(point: tuple[float, float], expected: bool) -> None:
    assert blocked(*point) is expected


def test_mapped_things_block_only_where_they_would_be_touched_at_once() -> None:
    assert blocked(0.40, 0.0) is True
    assert blocked(0.40, 0.0, mapped=True) is False
    assert blocked(0.28, 0.0, mapped=True) is True
    assert blocked(0.20, 0.25, mapped=True) is False


def test_what_lies_beyond_the_end_of_the_way_does_not_block() -> None:
    assert blocked(0.40, 0.0, reach_m=0.05) is False


def test_an_empty_scan_blocks_nothing() -> None:
    nothing = scan_points(np.zeros(360))
    assert not is_blocked(nothing, np.zeros(0, dtype=bool), reach_m=1.0, radius_m=RADIUS_M)
