import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from vla_deploy.robots.floor_pose import Pose2D

COORDINATE = st.floats(-10, 10)


@given(COORDINATE, COORDINATE, st.floats(-4, 4), COORDINATE, COORDINATE)
def test_outward_undoes_local(x: float, y: float, yaw: float, px: float, py: float) -> None:
    pose = Pose2D(x, y, yaw)
    local = pose.local((px, py, 0.7))
    assert pose.outward(*local) == pytest.approx((px, py), abs=1e-9)
    assert pose.place(np.array([local]))[0] == pytest.approx((px, py), abs=1e-9)
    there = pose.compose(Pose2D(*local, 0.3))
    assert (there.x_m, there.y_m) == pytest.approx((px, py), abs=1e-9)
    assert there.relative_to(pose).yaw_rad == pytest.approx(0.3)


def test_what_lies_ahead_of_a_turned_robot_has_a_positive_x() -> None:
    pose = Pose2D(1.0, 1.0, math.pi / 2)
    assert pose.local((1.0, 2.0)) == pytest.approx((1.0, 0.0))
    assert pose.local((0.0, 1.0)) == pytest.approx((0.0, 1.0))
