import math

import numpy as np
import pytest

from vla_deploy.manipulation.errors import TooWide
from vla_deploy.manipulation.grasps import GRASP_RULES, grasps_from_above, hand_down
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
