import math

import numpy as np
import pytest

from vla_deploy.manipulation.errors import NotFromSide, TooWide
from vla_deploy.manipulation.grasps import (
    GRASP_RULES,
    HAND_ABOVE_SUPPORT_M,
    SIDE_TILTS_RAD,
    TIP_BEYOND_GRIP_M,
    GraspKind,
    drawn_back,
    grasps_from_above,
    grasps_from_side,
    hand_at,
    hand_down,
)
from vla_deploy.plans.catalogue import GRASPABLE_CLASSES

CENTRE = (0.4, 0.1, 0.5)


def test_every_graspable_class_has_a_rule() -> None:
    assert set(GRASP_RULES) == set(GRASPABLE_CLASSES)


def test_a_round_thing_is_offered_from_all_around() -> None:
    grasps = grasps_from_above("cup", CENTRE, (0.066, 0.066, 0.095), 0.0, 0.088)
    assert len({grasp.yaw_rad for grasp in grasps}) == 16
    assert all(grasp.opening_m <= 0.088 for grasp in grasps)


def test_a_long_thing_is_taken_across_its_length() -> None:
    yaw = 0.4
    for grasp in grasps_from_above("phone", CENTRE, (0.14, 0.07, 0.01), yaw, 0.088):
        closing = hand_down(CENTRE, grasp.yaw_rad)[:3, 1]
        along = np.array((math.cos(yaw), math.sin(yaw), 0.0))
        assert abs(float(closing @ along)) < 1e-9


def test_length_and_width_may_be_swapped_by_the_eye() -> None:
    along = grasps_from_above("phone", CENTRE, (0.14, 0.07, 0.01), 0.0, 0.088)[0]
    across = grasps_from_above("phone", CENTRE, (0.07, 0.14, 0.01), math.pi / 2, 0.088)[0]
    assert math.cos(2 * (along.yaw_rad - across.yaw_rad)) == pytest.approx(1.0)


@pytest.mark.parametrize("height_m", [0.008, 0.02, 0.05, 0.2])
def test_the_finger_tips_stay_above_the_support(height_m: float) -> None:
    grasp = grasps_from_above("object", CENTRE, (0.04, 0.04, height_m), 0.0, 0.088)[0]
    support_m = CENTRE[2] - height_m / 2
    assert grasp.point_m[2] - support_m >= 0.018 - 1e-12
    assert grasp.below_grip_m == pytest.approx(grasp.point_m[2] - support_m)


def test_what_does_not_fit_between_the_fingers_is_refused_with_both_widths() -> None:
    with pytest.raises(TooWide, match=r"120 mm wide.*open 88 mm"):
        grasps_from_above("object", CENTRE, (0.12, 0.13, 0.1), 0.0, 0.088)


def test_a_hand_that_points_down_is_a_right_handed_frame() -> None:
    pose = hand_down(CENTRE, 0.7)
    assert np.linalg.det(pose[:3, :3]) == pytest.approx(1.0)
    assert pose[:3, 2] == pytest.approx((0, 0, -1))


def test_what_stands_and_is_round_is_taken_from_the_side_of_its_arm() -> None:
    grasps = grasps_from_side("bottle", CENTRE, (0.056, 0.056, 0.18), (0.0, 0.1, 0.9), 0.088)
    assert {grasp.kind for grasp in grasps} == {GraspKind.SIDE}
    for grasp in grasps:
        pose = hand_at(grasp.point_m, grasp.yaw_rad, grasp.tilt_rad)
        assert pose[2, 2] == pytest.approx(0.0)  # level
        assert pose[2, 1] == pytest.approx(0.0)  # the fingers close level, too
        assert pose[0, 2] > -1e-9  # away from the shoulder
        assert abs(pose[2, 0]) == pytest.approx(1.0)
        tips = drawn_back(pose, grasp.way_in_m)[:3, 3] + TIP_BEYOND_GRIP_M * pose[:3, 2]
        assert math.dist(tips[:2], CENTRE[:2]) > 0.028 + 0.015, "the way in begins beside it"


@pytest.mark.parametrize("tilt_rad", SIDE_TILTS_RAD)
@pytest.mark.parametrize("height_m", [0.08, 0.18, 0.3])
def test_from_the_side_hand_and_fingers_stay_above_the_support(
    height_m: float, tilt_rad: float
) -> None:
    size_m = (0.05, 0.05, height_m)
    grasp = grasps_from_side("can", CENTRE, size_m, (0, 0, 0.9), 0.088, tilt_rad)[0]
    assert grasp.below_grip_m >= HAND_ABOVE_SUPPORT_M
    assert grasp.below_grip_m <= height_m - 0.02
    assert grasp.point_m[2] == pytest.approx(CENTRE[2] - height_m / 2 + grasp.below_grip_m)


@pytest.mark.parametrize(
    ("kind", "size_m", "why"),
    [
        ("object", (0.05, 0.055, 0.15), ""),
        ("cup", (0.069, 0.069, 0.094), ""),
        ("object", (0.03, 0.06, 0.15), "not round"),
        ("book", (0.16, 0.03, 0.2), "not round"),
        ("cup", (0.05, 0.05, 0.06), "60 mm high"),
        ("ball", (0.07, 0.07, 0.07), "70 mm high.*84 mm"),
        ("bowl", (0.08, 0.08, 0.07), "70 mm high"),
    ],
)
def test_by_kind_and_size_it_is_told_what_is_taken_from_the_side(
    kind: str, size_m: tuple[float, float, float], why: str
) -> None:
    if not why:
        assert grasps_from_side(kind, CENTRE, size_m, (0, 0, 0.9), 0.088)
        return
    with pytest.raises(NotFromSide, match=why):
        grasps_from_side(kind, CENTRE, size_m, (0, 0, 0.9), 0.088)


def test_what_a_tilted_hand_holds_upright_is_upright_at_every_yaw() -> None:
    for tilt_rad in (1.1, -1.1):
        held = hand_at(CENTRE, 0.3, tilt_rad)
        upright = held[:3, :3].T @ np.array((0.0, 0.0, 1.0))
        for yaw_rad in (-2.0, 0.0, 1.5):
            turned = hand_at(CENTRE, yaw_rad, tilt_rad)
            assert np.linalg.det(turned[:3, :3]) == pytest.approx(1.0)
            assert turned[:3, :3] @ upright == pytest.approx((0.0, 0.0, 1.0))
    assert hand_at(CENTRE, 0.7, 0.0, 0.01) == pytest.approx(hand_down(CENTRE, 0.7, 0.01))
