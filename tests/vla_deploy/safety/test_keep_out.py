"""Keep-out areas: how deep the base is or will be, and which motions lead deeper."""

import math
from dataclasses import replace

import numpy as np
import pytest

from vla_deploy.safety.keep_out import judge_keep_out, seen_from
from vla_deploy.safety.surroundings import Direction
from vla_deploy.safety.zones import Footprint, Motion

ROUND = Footprint(corners_m=((0.0, 0.0),), radius_m=0.25)
LONG = Footprint(corners_m=((0.5, 0.1), (-0.5, 0.1), (-0.5, -0.1), (0.5, -0.1)), radius_m=0.0)
STANDING = Motion(v_m_s=0.0, w_rad_s=0.0, deceleration_m_s2=0.5)
BOX = np.array([[1.0, -1.0], [2.0, -1.0], [2.0, 1.0], [1.0, 1.0]])


def test_an_area_lies_around_the_base_as_its_pose_says() -> None:
    seen = seen_from(np.array([[2.0, 3.0]]), 2.0, 1.0, math.pi / 2)
    assert seen == pytest.approx(np.array([[2.0, 0.0]]), abs=1e-12)


def test_outside_with_room_to_stop_nothing_is_found() -> None:
    assert judge_keep_out({"box": BOX}, ROUND, STANDING, 0.1) is None
    assert judge_keep_out({}, ROUND, STANDING, 0.1) is None


def test_the_way_to_standstill_counts_as_driven() -> None:
    fast = replace(STANDING, v_m_s=0.5)
    near = BOX - (0.6, 0.0)
    found = judge_keep_out({"box": near}, ROUND, fast, 0.2)
    assert found is not None
    assert found.depth_m == pytest.approx(0.1 + 0.25 - 0.15)
    assert found.blocked == (Direction.FORWARD,)
    assert judge_keep_out({"box": near}, ROUND, replace(fast, v_m_s=-0.5), 0.2) is None


def test_the_deepest_area_is_told_and_backing_out_stays_open() -> None:
    areas = {"far": BOX - (0.8, 0.0), "near": BOX - (0.9, 0.0)}
    found = judge_keep_out(areas, ROUND, STANDING, 0.1)
    assert found is not None
    assert (found.name, found.blocked) == ("near", (Direction.FORWARD,))
    assert found.depth_m == pytest.approx(0.15)


def test_a_long_base_must_not_turn_its_end_into_the_area() -> None:
    beside = np.array([[0.3, 0.14], [1.0, 0.14], [1.0, 1.0], [0.3, 1.0]]) - (0.0, 0.05)
    found = judge_keep_out({"beside": beside}, LONG, STANDING, 0.0)
    assert found is not None
    assert Direction.TURN_LEFT in found.blocked
    assert Direction.TURN_RIGHT not in found.blocked
