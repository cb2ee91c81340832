"""How far a zone reaches: what lies beyond cannot set it off, in no motion."""

import math

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from vla_deploy.control.judging.zone_watch import reach_m, reaches_m
from vla_deploy.robots import load_robot
from vla_deploy.robots.protection import Zone, ZoneKind, ZoneSource
from vla_deploy.safety.zones import IDLE, BaseMotion, Footprint, Points, judge_zone, moved

ROBOT = load_robot("butler")
RADIUS_M = 0.24
ROUND = Footprint(corners_m=((0.0, 0.0),), radius_m=RADIUS_M)
BEYOND_M = 1e-6
LIDAR = (ZoneSource.LIDAR,)
SQUARE = ((0.5, 0.4), (-0.3, 0.4), (-0.3, -0.4), (0.5, -0.4))
ZONES = (
    Zone(name="near", kind=ZoneKind.STOP, sources=LIDAR, polygon_m=SQUARE, min_points=1),
    Zone(
        name="grows",
        kind=ZoneKind.STOP,
        sources=LIDAR,
        polygon_m=SQUARE,
        min_points=1,
        reaction_s=0.3,
    ),
    Zone(name="ahead", kind=ZoneKind.APPROACH, sources=LIDAR, time_before_collision_s=1.0),
)
motions = st.builds(
    BaseMotion,
    v_m_s=st.floats(-0.6, 0.6),
    w_rad_s=st.floats(-2.0, 2.0),
    deceleration_m_s2=st.just(0.6),
)
angles = st.lists(st.floats(-math.pi, math.pi), min_size=1, max_size=8)


def on_circle(radius_m: float, angles_rad: list[float]) -> Points:
    return radius_m * np.array([(math.cos(a), math.sin(a)) for a in angles_rad])


@given(zone=st.sampled_from(ZONES), motion=motions, angles_rad=angles)
def test_nothing_beyond_the_reach_sets_a_zone_off(
    zone: Zone, motion: BaseMotion, angles_rad: list[float]
) -> None:
    points = on_circle(reach_m(zone, motion, RADIUS_M) + BEYOND_M, angles_rad)
    trigger, finding = judge_zone(zone, IDLE, points, ROUND, motion, fresh=True)
    assert trigger is IDLE
    assert finding is None


@given(zone=st.sampled_from(ZONES[1:]), speed_m_s=st.floats(0.05, 0.6))
def test_what_lies_just_within_the_reach_ahead_sets_it_off(zone: Zone, speed_m_s: float) -> None:
    motion = BaseMotion(v_m_s=speed_m_s, w_rad_s=0.0, deceleration_m_s2=0.6)
    edge_m = reach_m(zone, motion, RADIUS_M) - 1e-3
    # A polygon reaches furthest at its corner, which grows straight ahead.
    x_m, y_m = (edge_m, 0.0) if not zone.polygon_m else (0.499 + edge_m - math.hypot(0.5, 0.4), 0.3)
    trigger, finding = judge_zone(zone, IDLE, np.array([(x_m, y_m)]), ROUND, motion, fresh=True)
    assert trigger.active
    assert finding is not None


@given(motion=motions)
def test_no_motion_reaches_further_than_the_fastest(motion: BaseMotion) -> None:
    furthest_m = reaches_m(ROBOT)
    for zone in ROBOT.protection.zones:
        assert reach_m(zone, motion, ROBOT.base.footprint_radius_m) <= furthest_m[zone.name]


@given(motion=motions, time_s=st.floats(0.0, 1.0), angles_rad=angles)
def test_a_base_meets_only_what_it_can_drive_to(
    motion: BaseMotion, time_s: float, angles_rad: list[float]
) -> None:
    points = on_circle(1.0, angles_rad)
    seen = moved(points, motion.v_m_s * time_s, motion.w_rad_s * time_s)
    assert np.hypot(*seen.T).min() >= 1.0 - abs(motion.v_m_s) * time_s - BEYOND_M
