"""Zones around the base: what is inside, what it leads to, and that the way out stays open."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from vla_deploy.robots.protection import Zone, ZoneKind, ZoneSource
from vla_deploy.safety.surroundings import Direction
from vla_deploy.safety.zones import (
    IDLE,
    LEAST_RATIO,
    BaseMotion,
    Footprint,
    Points,
    ZoneMemory,
    braking_m,
    directions_towards,
    inside,
    judge_zone,
    moved,
    signed_distance,
    stretched,
    time_to_collision,
)

ROUND = Footprint(corners_m=((0.0, 0.0),), radius_m=0.24)
LONG = Footprint(corners_m=((0.4, 0.2), (-0.4, 0.2), (-0.4, -0.2), (0.4, -0.2)), radius_m=0.0)
SQUARE = ((0.5, 0.5), (-0.5, 0.5), (-0.5, -0.5), (0.5, -0.5))
STANDING = BaseMotion(v_m_s=0.0, w_rad_s=0.0, deceleration_m_s2=0.6)
CRUISING = replace(STANDING, v_m_s=0.45)
STOP = Zone(name="near", kind=ZoneKind.STOP, sources=(ZoneSource.LIDAR,), polygon_m=SQUARE)
APPROACH = Zone(
    name="ahead",
    kind=ZoneKind.APPROACH,
    sources=(ZoneSource.LIDAR,),
    time_before_collision_s=1.0,
)

coordinates = st.floats(-1.5, 1.5).filter(lambda value: abs(value) > 1e-3)
clouds = st.lists(st.tuples(coordinates, coordinates), max_size=12).map(
    lambda rows: np.array(rows, dtype=np.float64).reshape(-1, 2)
)
motions = st.builds(
    BaseMotion,
    v_m_s=st.floats(-0.5, 0.5),
    w_rad_s=st.floats(-1.5, 1.5),
    deceleration_m_s2=st.just(0.6),
)


def cloud(*points: tuple[float, float]) -> Points:
    return np.array(points, dtype=np.float64).reshape(-1, 2)


def test_a_point_is_inside_a_polygon_or_not() -> None:
    found = inside(cloud((0.0, 0.0), (0.6, 0.0), (0.0, -0.6), (0.49, 0.49)), np.array(SQUARE))
    assert found.tolist() == [True, False, False, True]


def test_distance_is_signed_and_to_the_nearest_edge() -> None:
    distance = signed_distance(cloud((0.7, 0.0), (0.4, 0.0), (0.8, 0.9)), np.array(SQUARE))
    assert distance == pytest.approx([0.2, -0.1, 0.5])


def test_a_round_footprint_is_one_corner_and_a_radius() -> None:
    assert ROUND.distance(cloud((0.34, 0.0), (0.0, -0.14))) == pytest.approx([0.1, -0.1])


def test_points_come_nearer_as_the_base_drives_and_go_round_as_it_turns() -> None:
    assert moved(cloud((1.0, 0.0)), 0.25, 0.0) == pytest.approx(cloud((0.75, 0.0)))
    assert moved(cloud((1.0, 0.0)), 0.0, math.pi / 2) == pytest.approx(cloud((0.0, -1.0)))
    quarter = moved(cloud((1.0, 1.0)), math.pi / 2, math.pi / 2)
    assert quarter == pytest.approx(cloud((0.0, 0.0)), abs=1e-12)


def test_the_way_to_standstill_is_reaction_and_braking() -> None:
    assert braking_m(CRUISING, 0.2) == pytest.approx(0.45 * 0.2 + 0.45**2 / 1.2)


def test_a_zone_with_a_reaction_time_grows_along_the_motion_only() -> None:
    zone = replace(STOP, reaction_s=0.2)
    grown = braking_m(CRUISING, 0.2)
    ahead, back = stretched(zone, CRUISING), stretched(zone, replace(CRUISING, v_m_s=-0.45))
    assert [ahead[:, 0].min(), ahead[:, 0].max()] == pytest.approx([-0.5, 0.5 + grown])
    assert [back[:, 0].min(), back[:, 0].max()] == pytest.approx([-0.5 - grown, 0.5])
    assert stretched(zone, STANDING).tolist() == np.array(SQUARE).tolist()
    assert stretched(STOP, CRUISING).tolist() == np.array(SQUARE).tolist()


@pytest.mark.parametrize(
    ("point", "blocked"),
    [
        ((0.3, 0.0), {Direction.FORWARD}),
        ((-0.3, 0.05), {Direction.BACKWARD}),
        ((0.0, 0.3), set()),
        ((0.21, 0.21), {Direction.FORWARD}),
    ],
)
def test_a_round_base_is_blocked_only_towards_the_point(
    point: tuple[float, float], blocked: set[Direction]
) -> None:
    assert set(directions_towards(cloud(point), ROUND)) == blocked


def test_a_long_base_must_not_turn_its_corner_into_a_point_beside_it() -> None:
    assert set(directions_towards(cloud((0.35, 0.25)), LONG)) == {Direction.TURN_LEFT}
    assert set(directions_towards(cloud((-0.35, 0.25)), LONG)) == {Direction.TURN_RIGHT}


def test_without_points_nothing_is_blocked_or_about_to_be_hit() -> None:
    assert directions_towards(cloud(), ROUND) == ()
    assert time_to_collision(cloud(), ROUND, CRUISING, 1.0) == math.inf


def test_a_collision_is_foreseen_by_distance_over_speed() -> None:
    seen = time_to_collision(cloud((0.465, 0.0)), ROUND, CRUISING, 1.0)
    assert seen == pytest.approx(0.5, abs=0.01)
    beyond = time_to_collision(cloud((0.9, 0.0)), ROUND, CRUISING, 1.0)
    assert beyond == math.inf
    assert time_to_collision(cloud((0.465, 0.0)), ROUND, STANDING, 1.0) == math.inf


def test_what_the_base_touches_but_leaves_is_no_collision() -> None:
    away = replace(CRUISING, v_m_s=-0.3)
    assert time_to_collision(cloud((0.2, 0.0)), ROUND, away, 1.0) == math.inf


def test_a_stop_zone_needs_its_points_and_its_samples_and_is_released_by_its_count() -> None:
    zone = replace(STOP, min_points=2, trigger_count=2, release_count=2)
    near, alone = cloud((0.4, 0.0), (0.4, 0.1)), cloud((0.4, 0.0))
    trigger, found = judge_zone(zone, IDLE, alone, ROUND, STANDING, fresh=True)
    assert (trigger, found) == (IDLE, None)
    trigger, found = judge_zone(zone, trigger, near, ROUND, STANDING, fresh=True)
    assert found is None
    trigger, found = judge_zone(zone, trigger, near, ROUND, STANDING, fresh=False)
    assert found is None
    trigger, found = judge_zone(zone, trigger, near, ROUND, STANDING, fresh=True)
    assert found is not None
    assert (found.points, found.blocked) == (2, (Direction.FORWARD,))
    assert found.measured == pytest.approx(0.16)
    trigger, found = judge_zone(zone, trigger, cloud(), ROUND, STANDING, fresh=True)
    assert found is not None
    assert (found.blocked, found.measured) == ((Direction.FORWARD,), math.inf)
    trigger, found = judge_zone(zone, trigger, near, ROUND, STANDING, fresh=True)
    assert trigger.misses == 0
    for _ in range(2):
        trigger, found = judge_zone(zone, trigger, cloud(), ROUND, STANDING, fresh=True)
    assert (trigger, found) == (IDLE, None)


def test_a_slow_zone_asks_for_its_ratio_and_blocks_nothing() -> None:
    zone = replace(STOP, kind=ZoneKind.SLOW, speed_ratio=0.4, min_points=1)
    _, found = judge_zone(zone, IDLE, cloud((0.4, 0.0)), ROUND, CRUISING, fresh=True)
    assert found is not None
    assert (found.kind, found.speed_ratio, found.blocked) == (ZoneKind.SLOW, 0.4, ())


def test_an_approach_zone_slows_by_the_share_of_time_that_is_left() -> None:
    trigger, found = judge_zone(APPROACH, IDLE, cloud((0.465, 0.0)), ROUND, CRUISING, fresh=True)
    assert found is not None
    assert found.speed_ratio == pytest.approx(0.5, abs=0.01)
    _, touching = judge_zone(APPROACH, IDLE, cloud((0.23, 0.0)), ROUND, CRUISING, fresh=True)
    assert touching is not None
    assert touching.speed_ratio == LEAST_RATIO
    _, found = judge_zone(APPROACH, trigger, cloud((0.465, 0.0)), ROUND, STANDING, fresh=False)
    assert found is not None
    assert found.speed_ratio == 1.0


def test_a_zone_tells_how_near_the_nearest_point_is_and_how_far_it_reaches_as_it_moves() -> None:
    both = (ZoneSource.DEPTH, ZoneSource.LIDAR)
    zone = replace(STOP, sources=both, min_points=1, reaction_s=0.2)
    points = cloud((0.7, 0.0), (0.6, 0.0))
    _, found = judge_zone(zone, IDLE, points, ROUND, CRUISING, fresh=True)
    assert found is not None
    assert (found.sources, found.measured) == (both, pytest.approx(0.36))
    corner_m = math.hypot(0.5 + braking_m(CRUISING, 0.2), 0.5)
    assert found.limit == pytest.approx(corner_m - ROUND.radius_m)


def test_an_approach_zone_tells_the_time_to_the_collision_and_how_far_it_looks_ahead() -> None:
    ahead = replace(APPROACH, time_before_collision_s=0.8)
    _, found = judge_zone(ahead, IDLE, cloud((0.465, 0.0)), ROUND, CRUISING, fresh=True)
    assert found is not None
    assert (found.measured, found.limit) == (pytest.approx(0.5, abs=0.01), 0.8)


@given(clouds, motions)
def test_what_is_in_a_zone_is_never_further_than_it_reaches(
    points: Points, motion: BaseMotion
) -> None:
    zone = replace(STOP, min_points=1, reaction_s=0.2)
    for footprint in (ROUND, LONG):
        _, found = judge_zone(zone, IDLE, points, footprint, motion, fresh=True)
        assert found is None or found.measured <= found.limit + 1e-9


@given(clouds)
def test_the_way_out_is_open_when_all_points_lie_on_one_side(points: Points) -> None:
    ahead = points * (1.0, 1.0)
    ahead[:, 0] = np.abs(ahead[:, 0])
    assert Direction.BACKWARD not in directions_towards(ahead, ROUND)
    assert Direction.FORWARD not in directions_towards(-ahead, ROUND)


@given(clouds)
def test_a_single_point_never_blocks_both_ways(points: Points) -> None:
    for point in points:
        for footprint in (ROUND, LONG):
            outside = cloud(tuple(point))
            if footprint.distance(outside)[0] > 0.0:
                blocked = directions_towards(outside, footprint)
                assert not {Direction.FORWARD, Direction.BACKWARD} <= set(blocked)
                assert not {Direction.TURN_LEFT, Direction.TURN_RIGHT} <= set(blocked)


@given(clouds, st.integers(0, 12), motions)
def test_fewer_points_never_restrict_more(points: Points, kept: int, motion: BaseMotion) -> None:
    fewer = points[:kept]
    assert set(directions_towards(fewer, ROUND)) <= set(directions_towards(points, ROUND))
    assert time_to_collision(fewer, ROUND, motion, 1.0) >= (
        time_to_collision(points, ROUND, motion, 1.0) - 1e-9
    )
    for zone in (replace(STOP, min_points=1), APPROACH):
        _, less = judge_zone(zone, IDLE, fewer, ROUND, motion, fresh=True)
        _, more = judge_zone(zone, IDLE, points, ROUND, motion, fresh=True)
        assert less is None or more is not None
        if less is not None and more is not None:
            assert set(less.blocked) <= set(more.blocked)
            assert less.speed_ratio >= more.speed_ratio - 1e-9


@given(st.floats(0.05, 0.5), st.floats(0.0, 0.5))
def test_a_faster_base_has_a_larger_zone(speed_m_s: float, reaction_s: float) -> None:
    zone = replace(STOP, reaction_s=reaction_s)
    slow = stretched(zone, replace(STANDING, v_m_s=0.5 * speed_m_s))
    fast = stretched(zone, replace(STANDING, v_m_s=speed_m_s))
    assert fast[:, 0].max() > slow[:, 0].max()


@given(clouds, st.floats(-0.5, 0.5), st.floats(-2.0, 2.0))
def test_driving_an_arc_there_and_back_moves_no_point(
    points: Points, forward_m: float, turn_rad: float
) -> None:
    back = moved(moved(points, forward_m, turn_rad), -forward_m, -turn_rad)
    assert back == pytest.approx(points, abs=1e-9)


def test_an_idle_trigger_remembers_nothing() -> None:
    assert ZoneMemory() == IDLE
