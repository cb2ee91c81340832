import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from vla_deploy.robots.description import FloorPose
from vla_deploy.skills.movements.frames import to_base, to_map

COORDINATE = st.floats(-10, 10)


@given(COORDINATE, COORDINATE, st.floats(-4, 4), COORDINATE, COORDINATE)
def test_to_map_undoes_to_base(x: float, y: float, yaw: float, px: float, py: float) -> None:
    pose = FloorPose(x_m=x, y_m=y, yaw_rad=yaw)
    bx, by, bz = to_base(pose, (px, py, 0.7))
    assert to_map(pose, bx, by) == pytest.approx((px, py), abs=1e-9)
    assert bz == 0.7


def test_what_lies_ahead_of_a_turned_robot_has_a_positive_x() -> None:
    pose = FloorPose(x_m=1.0, y_m=1.0, yaw_rad=math.pi / 2)
    assert to_base(pose, (1.0, 2.0, 0.0)) == pytest.approx((1.0, 0.0, 0.0))
    assert to_base(pose, (0.0, 1.0, 0.0)) == pytest.approx((0.0, 1.0, 0.0))
