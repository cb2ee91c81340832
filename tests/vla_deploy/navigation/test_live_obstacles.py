import itertools
import math

import numpy as np
import pytest

from drivers.clock import NS_PER_S
from tests.vla_deploy.navigation.conftest import SCAN_NS, TracedFlat
from vla_deploy.navigation.errors import NoPath
from vla_deploy.navigation.localising.dead_reckoning import DeadReckoning
from vla_deploy.navigation.localising.scan import placed_beams
from vla_deploy.navigation.obstacles.live_obstacles import CELL_M, KEPT_NS, LiveObstacles
from vla_deploy.navigation.path_planning import PathPlanner
from vla_deploy.robots.floor_pose import ORIGIN, Points, Pose2D

HERE = Pose2D(1.5, 2.0, 0.4)
AT = np.array((HERE.x_m, HERE.y_m))
CRATE = (2.3, 2.1, 2.6, 2.4)
RADIUS_M = 0.25


class Watch:
    """Scan a flat ten times a second from poses that are known well."""

    def __init__(self) -> None:
        self.flat = TracedFlat()
        self.live = LiveObstacles(self.flat.map())
        self.now_ns = NS_PER_S

    def scan(self, pose: Pose2D = HERE, times: int = 1) -> None:
        for _ in range(times):
            self.now_ns += SCAN_NS
            ranges = self.flat.scan(pose, seed=self.now_ns // SCAN_NS)
            stamps = np.full(len(ranges), self.now_ns)
            seen = placed_beams(DeadReckoning(), ORIGIN, ranges, stamps)
            self.live.see(seen.placed(pose), self.now_ns)

    def around(self) -> Points:
        return self.live.around(AT, self.now_ns)


@pytest.fixture
def watch() -> Watch:
    return Watch()


@pytest.mark.parametrize("pose", [HERE, Pose2D(5.2, 1.0, 2.0), Pose2D(3.7, 4.0, -1.0)])
def test_what_is_on_the_map_is_none(watch: Watch, pose: Pose2D) -> None:
    watch.scan(pose, times=10)
    assert not len(watch.around())
    assert watch.live.movers == ()


def test_what_stands_beside_the_map_is_where_its_front_is_and_does_not_move(watch: Watch) -> None:
    watch.flat.solids.append(CRATE)
    watch.scan(times=20)
    cells = watch.around()
    assert len(cells) > 5
    x0, y0, x1, y1 = CRATE
    low, high = np.array((x0, y0)) - CELL_M, np.array((x1, y1)) + CELL_M
    assert ((cells > low) & (cells < high)).all()
    away_m = np.hypot(*(cells - AT).T)
    assert (np.diff(away_m) >= 0.0).all()
    assert watch.live.movers == ()


def test_it_is_gone_when_one_looks_through_its_place_and_kept_for_a_while_unseen(
    watch: Watch,
) -> None:
    watch.flat.solids.append(CRATE)
    watch.scan(times=3)
    behind_the_wall = Pose2D(5.0, 0.6, 0.0)
    watch.scan(behind_the_wall, times=5)
    assert len(watch.around())
    watch.flat.solids.remove(CRATE)
    watch.scan()
    assert not len(watch.around())
    watch.flat.solids.append(CRATE)
    watch.scan(times=3)
    watch.now_ns += KEPT_NS + 1
    assert not len(watch.around())


def test_what_is_seen_once_only_is_none(watch: Watch) -> None:
    watch.flat.solids.append(CRATE)
    watch.scan()
    assert not len(watch.around())


def test_somebody_who_walks_is_followed_and_leaves_no_trail_and_stands_at_last(
    watch: Watch,
) -> None:
    y_m = 1.2
    for _ in range(25):
        y_m += 0.07
        watch.flat.solids[-1:] = [(2.6, y_m, 2.8, y_m + 0.2)]
        watch.scan()
    (mover,) = watch.live.movers
    assert mover.vy_m_s == pytest.approx(0.7, abs=0.15)
    assert abs(mover.vx_m_s) < 0.15
    assert math.dist((mover.x_m, mover.y_m), (2.65, y_m + 0.1)) < 0.2
    assert (np.abs(watch.around()[:, 1] - y_m) < 0.5).all()
    watch.scan(times=30)
    assert watch.live.movers == ()


def test_a_way_leads_around_what_is_in_it_or_is_closed() -> None:
    planner = PathPlanner(TracedFlat().map(), RADIUS_M)
    start, goal = (1.0, 3.5), (3.8, 3.5)
    thing = np.array([(2.4, y_m) for y_m in np.arange(3.2, 3.8, CELL_M)])
    way = planner.around(thing, 0.08).plan(start, goal)
    samples = np.vstack([np.linspace(a, b, 40) for a, b in itertools.pairwise(way)])
    away_m = np.linalg.norm(samples[:, None] - thing[None], axis=2)
    assert away_m.min() > RADIUS_M
    assert np.allclose(planner.plan(start, goal)[-1], way[-1])
    wall = np.array([(2.4, y_m) for y_m in np.arange(0.0, 5.0, CELL_M)])
    with pytest.raises(NoPath):
        planner.around(wall, 0.08).plan(start, goal)
