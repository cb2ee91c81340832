"""Who is reported of what moves: each person once for as long as they stay."""

import numpy as np
import pytest

from drivers.clock import NS_PER_S
from vla_deploy.navigation.obstacles.arrivals import Arrivals
from vla_deploy.robots.floor_pose import Points

SCAN_S = 0.1
WALK_M_S = 0.7
NOTICED_S = 0.5
"""What has left its place by 0.3 m moves."""
CHAIR = (3.0, 0.0)
Span = tuple[float, float]


def cluster(x_m: float, y_m: float) -> list[tuple[float, float]]:
    """Return the cells of two legs."""
    return [(x_m + dx, y_m + dy) for dx in (-0.1, 0.0, 0.1) for dy in (-0.1, 0.1)]


def rows(values: list[tuple[float, ...]], width: int) -> Points:
    """Return an array of so many columns, also of nothing."""
    return np.array(values, dtype=np.float64).reshape(-1, width)


def reports(
    walks: dict[float, Span], *, stays: bool = False, chair: bool = False, stood: bool = False
) -> int:
    """Count reports in 20 s; `walks` are lanes y with the span of time in which they are walked.

    Who `stays` stands at the end of their lane; who has `stood` did so before theirs.
    """
    fixed = cluster(*CHAIR) if chair else []
    arrivals = Arrivals(rows([*fixed, *(cluster(0.0, 0.0) if stood else [])], 2))
    told = 0
    for step in range(200):
        now_s = step * SCAN_S
        points: list[tuple[float, ...]] = [*fixed]
        movers: list[tuple[float, ...]] = []
        for y_m, (begin_s, end_s) in walks.items():
            x_m = WALK_M_S * (min(max(now_s, begin_s), end_s) - begin_s)
            if begin_s + NOTICED_S <= now_s <= end_s:
                movers.append((x_m, y_m, WALK_M_S, 0.0))
            elif end_s < now_s < end_s + 2.0 and stays:
                movers.append((x_m, y_m, 0.05, 0.0))
            if begin_s <= now_s <= end_s or (now_s < begin_s and stood) or stays:
                points += cluster(x_m, y_m)
        told += len(arrivals.see(rows(points, 2), rows(movers, 4), round(now_s * NS_PER_S)))
    return told


@pytest.mark.parametrize(
    ("told", "walks", "more"),
    [
        (0, {}, {"chair": True}),
        (1, {0.0: (1.0, 4.0)}, {}),
        (1, {0.0: (1.0, 4.0)}, {"stays": True}),
        (2, {0.0: (1.0, 4.0), 1.0: (1.5, 4.5)}, {}),
        (1, {0.0: (1.0, 4.0), 0.2: (1.0, 4.0)}, {}),  # a leg of theirs, seen apart
        (0, {0.0: (1.0, 1.7)}, {}),  # too short for anybody
        (1, {0.0: (1.0, 2.0), 0.1: (3.0, 5.0)}, {}),  # out of sight for a second
        (2, {0.0: (1.0, 3.0), 0.1: (10.0, 12.0)}, {}),  # gone, and back
        (1, {0.0: (1.0, 6.0)}, {"chair": True}),  # past a chair that stays
        (0, {0.0: (1.0, 4.0)}, {"stood": True}),  # was there from the beginning
    ],
)
def test_each_person_is_reported_once_as_long_as_they_stay(
    told: int, walks: dict[float, Span], more: dict[str, bool]
) -> None:
    assert reports(walks, **more) == told
