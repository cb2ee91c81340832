import math
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from vla_deploy.navigation.follower import DriveLimits, FollowerPhase, PathFollower, Twist
from vla_deploy.robots.floor_pose import wrap_angle

LIMITS = DriveLimits(
    speed_m_s=0.5, turn_rate_rad_s=1.0, acceleration_m_s2=0.5, turn_acceleration_rad_s2=2.0
)


class UnicycleWithRamp:
    """Integrate a unicycle whose acceleration is limited, as the base's is."""

    def __init__(self, yaw_rad: float) -> None:
        self.x_m = self.y_m = self.v_m_s = self.w_rad_s = 0.0
        self.yaw_rad = yaw_rad

    def drive(self, twist: Twist, dt_s: float) -> None:
        dv, dw = 0.6 * dt_s, 3.0 * dt_s
        self.v_m_s += min(max(twist.v_m_s - self.v_m_s, -dv), dv)
        self.w_rad_s += min(max(twist.w_rad_s - self.w_rad_s, -dw), dw)
        self.x_m += self.v_m_s * math.cos(self.yaw_rad) * dt_s
        self.y_m += self.v_m_s * math.sin(self.yaw_rad) * dt_s
        self.yaw_rad = wrap_angle(self.yaw_rad + self.w_rad_s * dt_s)


def run(points: list[tuple[float, float]], start_yaw: float, final_yaw: float) -> tuple[float, ...]:
    body = UnicycleWithRamp(start_yaw)
    path = np.array(points)
    follower = PathFollower(path, LIMITS, final_yaw)
    off_path_m = 0.0
    for _ in range(6000):
        twist = follower.step(body.x_m, body.y_m, body.yaw_rad)
        assert abs(twist.v_m_s) <= LIMITS.speed_m_s
        assert abs(twist.w_rad_s) <= LIMITS.turn_rate_rad_s
        body.drive(twist, 0.02)
        off_path_m = max(off_path_m, distance_to(path, body.x_m, body.y_m))
        if follower.phase is FollowerPhase.ARRIVED:
            break
    assert follower.phase is FollowerPhase.ARRIVED
    end_m = math.hypot(body.x_m - path[-1, 0], body.y_m - path[-1, 1])
    return end_m, abs(wrap_angle(body.yaw_rad - final_yaw)), off_path_m


def distance_to(path: np.ndarray, x_m: float, y_m: float) -> float:
    nearest = math.inf
    for (ax, ay), (bx, by) in pairwise(path):
        length2 = (bx - ax) ** 2 + (by - ay) ** 2
        s = min(max(((x_m - ax) * (bx - ax) + (y_m - ay) * (by - ay)) / length2, 0.0), 1.0)
        nearest = min(nearest, math.hypot(ax + s * (bx - ax) - x_m, ay + s * (by - ay) - y_m))
    return nearest


@pytest.mark.parametrize("start_yaw", [0.0, 1.5, -1.5, math.pi])
def test_a_cornered_path_ends_at_its_point_and_heading(start_yaw: float) -> None:
    end_m, yaw_error, off_m = run([(0, 0), (1, 0), (1, 1.5), (2, 1.5)], start_yaw, -1.0)
    assert end_m < 0.05
    assert yaw_error < 0.05
    assert off_m < 0.2


@settings(max_examples=25, deadline=None)
@given(
    x=st.floats(-2, 2).filter(lambda v: abs(v) > 0.2),
    y=st.floats(-2, 2).filter(lambda v: abs(v) > 0.2),
    start=st.floats(-3.1, 3.1),
    final=st.floats(-3.1, 3.1),
)
def test_any_straight_path_is_finished(x: float, y: float, start: float, final: float) -> None:
    end_m, yaw_error, _ = run([(0, 0), (x, y)], start, final)
    assert end_m < 0.06
    assert yaw_error < 0.05


@pytest.mark.parametrize(
    ("angle", "wrapped"), [(math.pi, math.pi), (-math.pi, math.pi), (7.0, 7.0 - 2 * math.pi)]
)
def test_angles_wrap_to_the_half_open_circle(angle: float, wrapped: float) -> None:
    assert wrap_angle(angle) == pytest.approx(wrapped)
