"""Zones to the last bit: points on edges, motions just fast enough, collisions just in time."""

import math
from dataclasses import replace

import numpy as np
import pytest

from vla_deploy.robots.protection import Zone, ZoneKind, ZoneSource
from vla_deploy.safety import zones
from vla_deploy.safety.surroundings import Direction
from vla_deploy.safety.zones import (
    IDLE,
    PROBES,
    BaseMotion,
    Footprint,
    Points,
    directions_towards,
    inside,
    judge_zone,
    signed_distance,
    stretched,
    time_to_collision,
)

ROUND = Footprint(corners_m=((0.0, 0.0),), radius_m=0.25)
SMALL = replace(ROUND, radius_m=0.05)
LONG = Footprint(corners_m=((0.4, 0.2), (-0.4, 0.2), (-0.4, -0.2), (0.4, -0.2)), radius_m=0.0)
STANDING = BaseMotion(v_m_s=0.0, w_rad_s=0.0, deceleration_m_s2=0.5)
CRUISING = replace(STANDING, v_m_s=0.5)
DIAMOND = np.array([[1.0, 0.0], [0.0, 1.0], [-1.0, 0.0], [0.0, -1.0]])
TRIANGLE = np.array([[0.0, 0.0], [4.0, 1.0], [1.0, 3.0]])
COMB = np.array(
    [[0, 0], [5, 0], [5, 2], [4, 2], [4, 1], [3, 1], [3, 2], [2, 2], [2, 1], [1, 1], [1, 2], [0, 2]]
)
KITE = ((0.5, 0.0), (0.0, 0.75), (-0.5, 0.25), (0.0, -0.75))
STOP = Zone(name="near", kind=ZoneKind.STOP, sources=(ZoneSource.LIDAR,), polygon_m=KITE)


def cloud(*points: tuple[float, float]) -> Points:
    return np.array(points, dtype=np.float64).reshape(-1, 2)


@pytest.mark.parametrize("corners", [DIAMOND, DIAMOND[::-1]])
def test_a_point_level_with_a_corner_is_counted_once(corners: Points) -> None:
    found = inside(cloud((0.0, 0.0), (-0.5, 0.0), (-1.5, 0.0), (-0.5, 1.0)), corners)
    assert found.tolist() == [True, True, False, False]


def test_slanted_edges_part_inside_from_outside() -> None:
    points = cloud((2.0, 0.6), (2.0, 0.4), (0.5, 1.4), (0.5, 1.6), (2.5, 1.9), (2.5, 2.1))
    assert inside(points, TRIANGLE).tolist() == [True, False, True, False, True, False]


def test_a_polygon_may_be_concave() -> None:
    points = cloud((0.5, 1.5), (1.5, 1.5), (2.5, 1.5), (3.5, 1.5), (4.5, 1.5), (1.5, 0.5))
    assert inside(points, COMB).tolist() == [True, False, True, False, True, True]


def test_polygons_side_by_side_share_no_point_of_their_edge_and_miss_none() -> None:
    left = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
    edge = cloud((1.0, 0.0), (1.0, 0.25), (1.0, 0.75))
    assert inside(edge, left).tolist() == [False] * 3
    assert inside(edge, left + np.array([1.0, 0.0])).tolist() == [True] * 3


def test_the_distance_to_a_short_or_slanted_edge_is_square_to_it() -> None:
    box = 0.5 * np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
    assert signed_distance(cloud((0.7, 0.3), (0.2, 0.4)), box) == pytest.approx([0.2, -0.1])
    flank = signed_distance(cloud((1.0, 1.0), (0.0, 0.0)), DIAMOND)
    assert flank == pytest.approx([math.sqrt(0.5), -math.sqrt(0.5)])


def test_a_round_footprint_may_lie_beside_the_axle() -> None:
    aside = Footprint(corners_m=((0.5, 0.25),), radius_m=0.25)
    assert aside.distance(cloud((1.0, 0.25), (0.5, 1.25))) == pytest.approx([0.25, 0.75])


def test_a_polygon_footprint_may_have_a_margin() -> None:
    wide = replace(LONG, radius_m=0.1)
    assert wide.distance(cloud((0.8, 0.0), (0.0, 0.0))) == pytest.approx([0.3, -0.3])


@pytest.mark.parametrize(("v_m_s", "sign"), [(0.5, 1.0), (-0.5, -1.0)])
def test_only_corners_ahead_move_ahead(v_m_s: float, sign: float) -> None:
    grown = stretched(replace(STOP, reaction_s=0.5), replace(STANDING, v_m_s=v_m_s))
    expected = np.array(KITE)
    expected[0 if sign > 0.0 else 2, 0] += sign * 0.5  # 0.5 m/s for 0.5 s, then 0.25 m of braking
    assert grown.tolist() == expected.tolist()


@pytest.mark.parametrize(("v_m_s", "grows"), [(0.0009, False), (0.001, True), (-0.001, True)])
def test_a_zone_grows_from_the_least_speed_on(v_m_s: float, grows: bool) -> None:
    zone = stretched(replace(STOP, reaction_s=0.5), replace(STANDING, v_m_s=v_m_s))
    assert (zone.tolist() != np.array(KITE).tolist()) is grows


@pytest.mark.parametrize(
    ("v_m_s", "w_rad_s", "stands"),
    [
        (0.0009, -0.0009, True),
        (0.001, 0.0, False),
        (-0.001, 0.0, False),
        (0.0, 0.001, False),
        (0.0, -0.001, False),
    ],
)
def test_a_base_stands_below_the_least_speed(v_m_s: float, w_rad_s: float, stands: bool) -> None:
    assert replace(STANDING, v_m_s=v_m_s, w_rad_s=w_rad_s).stands is stands


def test_a_motion_that_hardly_leads_nearer_is_free() -> None:
    assert set(directions_towards(cloud((2.0, 0.1)), LONG)) == {Direction.FORWARD}


def test_one_point_of_many_blocks_a_motion() -> None:
    both = cloud((0.3, 0.0), (-0.3, 0.0))
    assert set(directions_towards(both, ROUND)) == {Direction.FORWARD, Direction.BACKWARD}


def test_only_more_than_the_share_of_its_way_leads_nearer(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(PROBES, Direction.FORWARD, (0.25, 0.0))
    monkeypatch.setattr(zones, "NEARER_SHARE", 1.0)
    assert directions_towards(cloud((1.0, 0.0)), ROUND) == ()


def test_a_collision_is_foreseen_between_two_steps() -> None:
    assert time_to_collision(cloud((0.51, 0.0)), ROUND, CRUISING, 1.0) == pytest.approx(0.52)


def test_the_earliest_of_several_collisions_counts() -> None:
    points = cloud((0.515, 0.0), (0.51, 0.0), (2.0, 2.0))
    assert time_to_collision(points, ROUND, CRUISING, 1.0) == pytest.approx(0.52)


def test_what_the_base_would_pass_through_is_a_collision() -> None:
    foreseen = time_to_collision(cloud((0.3, 0.0)), SMALL, CRUISING, 1.0)
    assert foreseen == pytest.approx(0.5)


@pytest.mark.parametrize(
    ("horizon_s", "x_m", "collision_s"),
    [
        (0.05, 0.26, 0.02),
        (0.07, 0.28, 0.06),
        (1.0, 0.75, 1.0),
        (1.0, 0.7500001, math.inf),
    ],
)
def test_a_collision_counts_up_to_the_horizon(
    horizon_s: float, x_m: float, collision_s: float
) -> None:
    foreseen = time_to_collision(cloud((x_m, 0.0)), ROUND, CRUISING, horizon_s)
    assert foreseen == pytest.approx(collision_s)


@pytest.mark.parametrize(("v_m_s", "collision_s"), [(0.0009, math.inf), (0.001, 0.5)])
def test_a_base_that_stands_collides_with_nothing(v_m_s: float, collision_s: float) -> None:
    creeping = replace(STANDING, v_m_s=v_m_s)
    foreseen = time_to_collision(cloud((0.2505, 0.0)), ROUND, creeping, 1.0)
    assert foreseen == pytest.approx(collision_s)


def test_a_long_base_that_turns_on_the_spot_meets_what_its_corner_sweeps() -> None:
    corner_rad, reach_m = math.atan2(0.2, 0.4), math.hypot(0.4, 0.2)
    ahead = 0.999 * reach_m * np.array([math.cos(corner_rad + 0.3), math.sin(corner_rad + 0.3)])
    turning = replace(STANDING, w_rad_s=1.0)
    foreseen = time_to_collision(cloud((ahead[0], ahead[1])), LONG, turning, 1.0)
    assert foreseen == pytest.approx(0.3, abs=0.01)
    assert time_to_collision(cloud((ahead[0], ahead[1])), LONG, turning, 0.25) == math.inf


def test_a_round_base_may_turn_on_the_spot_while_it_touches() -> None:
    turning = replace(STANDING, w_rad_s=1.0)
    assert time_to_collision(cloud((0.15, 0.1)), ROUND, turning, 1.0) == math.inf


def test_going_deeper_into_what_is_touched_collides_at_once() -> None:
    assert time_to_collision(cloud((0.2, 0.0)), ROUND, CRUISING, 1.0) == 0.0


def test_what_comes_nearer_by_no_more_than_rounding_does_not_count(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(zones, "_ROUNDING_M", 0.5)
    assert time_to_collision(cloud((0.75, 0.0)), ROUND, CRUISING, 1.0) == math.inf


def test_hits_must_come_in_a_row_and_misses_too() -> None:
    zone = replace(STOP, min_points=1, trigger_count=2, release_count=2)
    seen = []
    trigger = IDLE
    for hit in (1, 0, 1, 1, 0, 1, 0, 1, 0, 0, 1):
        points = cloud((0.3, 0.0)) if hit else cloud()
        trigger, found = judge_zone(zone, trigger, points, ROUND, STANDING, fresh=True)
        seen.append(found is not None)
    assert seen == [False, False, False, True, True, True, True, True, True, False, False]


def test_an_approach_zone_compares_with_its_own_time() -> None:
    zone = Zone(
        name="ahead",
        kind=ZoneKind.APPROACH,
        sources=(ZoneSource.LIDAR,),
        time_before_collision_s=2.0,
    )
    _, found = judge_zone(zone, IDLE, cloud((0.51, 0.0)), ROUND, CRUISING, fresh=True)
    assert found is not None
    assert found.speed_ratio == pytest.approx(0.26)
