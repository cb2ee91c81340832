"""Keep-out areas: how deep the base is or will be, and which motions lead deeper."""

import math
from dataclasses import replace

import numpy as np
import pytest

from vla_deploy.safety.keep_out import judge_keep_out, seen_from
from vla_deploy.safety.surroundings import Direction
from vla_deploy.safety.zones import PROBES, BaseMotion, Footprint

ROUND = Footprint(corners_m=((0.0, 0.0),), radius_m=0.25)
LONG = Footprint(corners_m=((0.5, 0.1), (-0.5, 0.1), (-0.5, -0.1), (0.5, -0.1)), radius_m=0.0)
STANDING = BaseMotion(v_m_s=0.0, w_rad_s=0.0, deceleration_m_s2=0.5)
BOX = np.array([[1.0, -1.0], [2.0, -1.0], [2.0, 1.0], [1.0, 1.0]])


def test_an_area_lies_around_the_base_as_its_pose_says() -> None:
    seen = seen_from(np.array([[2.0, 3.0]]), 2.0, 1.0, math.pi / 2)
    assert seen == pytest.approx(np.array([[2.0, 0.0]]), abs=1e-12)


def test_an_area_turns_against_the_base() -> None:
    corners = np.array([[2.0, 1.0], [1.0, 3.0]])
    c, s = math.cos(0.3), math.sin(0.3)
    expected = [[c * 1.0, -s * 1.0], [s * 2.0, c * 2.0]]  # the base's axes, met by each corner
    assert seen_from(corners, 1.0, 1.0, 0.3) == pytest.approx(np.array(expected))


def test_an_area_that_only_touches_is_not_entered() -> None:
    assert judge_keep_out({"box": BOX - (0.75, 0.0)}, ROUND, STANDING, 0.0) is None


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


def test_what_leads_deeper_into_any_area_is_blocked_whichever_is_deepest() -> None:
    behind = -BOX + (0.85, 0.0)
    found = judge_keep_out({"ahead": BOX - (0.9, 0.0), "behind": behind}, ROUND, STANDING, 0.1)
    assert found is not None
    assert (found.name, found.depth_m) == ("ahead", pytest.approx(0.15))
    assert found.blocked == (Direction.FORWARD, Direction.BACKWARD)


def test_an_area_that_is_only_near_blocks_nothing_beside_one_that_is_entered() -> None:
    areas = {"touched": -BOX + (0.75, 0.0), "entered": BOX - (0.9, 0.0)}
    found = judge_keep_out(areas, ROUND, STANDING, 0.1)
    assert found is not None
    assert (found.name, found.blocked) == ("entered", (Direction.FORWARD,))


def test_a_long_base_must_not_turn_its_end_into_the_area() -> None:
    beside = np.array([[0.3, 0.14], [1.0, 0.14], [1.0, 1.0], [0.3, 1.0]]) - (0.0, 0.05)
    found = judge_keep_out({"beside": beside}, LONG, STANDING, 0.0)
    assert found is not None
    assert Direction.TURN_LEFT in found.blocked
    assert Direction.TURN_RIGHT not in found.blocked


def test_sliding_along_an_edge_leads_no_deeper() -> None:
    beside = np.array([[-9.0, 0.2], [9.0, 0.25], [9.0, 1.0], [-9.0, 1.0]])
    found = judge_keep_out({"beside": beside}, ROUND, STANDING, 0.0)
    assert found is not None
    assert found.blocked == ()


def test_a_turn_that_hardly_leads_deeper_is_free() -> None:
    nose = Footprint(corners_m=((1.0, 0.0), (0.0, 0.0)), radius_m=0.0)
    slope = np.array([[0.9, -9.0], [9.0, -9.0], [9.0, 9.0], [0.9 - 0.45, 9.0]])
    found = judge_keep_out({"slope": slope}, nose, STANDING, 0.0)
    assert found is not None
    assert found.blocked == (Direction.FORWARD,)


def test_only_more_than_the_share_of_its_way_leads_deeper(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(PROBES, Direction.FORWARD, (0.25, 0.0))
    area = {"box": BOX - (0.875, 0.0)}
    monkeypatch.setattr("vla_deploy.safety.keep_out.NEARER_SHARE", 1.0)
    found = judge_keep_out(area, ROUND, STANDING, 0.0)
    assert found is not None
    assert found.blocked == ()
