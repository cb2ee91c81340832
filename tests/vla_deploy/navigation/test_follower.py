import math
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from vla_deploy.navigation.follower import (
    DriveLimits,
    FollowerPhase,
    PathFollower,
    Twist,
    is_blocked,
    scan_points,
)
from vla_deploy.robots.floor_pose import wrap_angle

LIMITS = DriveLimits(
    speed_m_s=0.5, turn_rate_rad_s=1.0, acceleration_m_s2=0.5, turn_acceleration_rad_s2=2.0
)
RADIUS_M = 0.24
REACH_M = 0.3


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


def test_a_short_step_aside_at_the_beginning_is_passed() -> None:
    points = [(0, 0), (-0.024, 0.028), (0.126, 0.178), (0.576, 0.178), (0.876, -0.022), (2, -1.1)]
    end_m, _, off_m = run(points, -1.57, 0.0)
    assert end_m < 0.05
    assert off_m < 0.2


def test_a_way_planned_anew_is_taken_up_without_a_halt() -> None:
    follower = PathFollower(np.array([(0.0, 0.0), (3.0, 0.0)]), LIMITS)
    assert follower.step(0.0, 0.0, 0.0).v_m_s > 0.0
    follower.take_up(np.array([(0.1, 0.0), (1.0, 0.3), (3.0, 0.5)]))
    curved = follower.step(0.1, 0.0, 0.0)
    assert curved.v_m_s > 0.0 and curved.w_rad_s > 0.0
    follower.take_up(np.array([(0.1, 0.0), (-1.0, 0.0)]))
    assert follower.step(0.1, 0.0, 0.0).v_m_s == 0.0


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


def blocked(x_m: float, y_m: float, *, mapped: bool = False, reach_m: float = REACH_M) -> bool:
    points = np.array([[x_m, y_m]])
    return is_blocked(points, np.array([mapped]), reach_m=reach_m, radius_m=RADIUS_M)


def test_a_scan_becomes_points_without_the_beams_that_saw_nothing() -> None:
    ranges = np.zeros(360)
    ranges[0], ranges[90], ranges[270] = 1.0, 2.0, 3.0
    assert scan_points(ranges) == pytest.approx(np.array([[1.0, 0.0], [0.0, 2.0], [0.0, -3.0]]))


@pytest.mark.parametrize(
    ("point", "expected"),
    [
        ((0.50, 0.00), True),
        ((0.60, 0.00), False),
        ((-0.30, 0.00), False),
        ((0.40, 0.26), True),
        ((0.40, 0.30), False),
        # The body is round: what its edge only reaches later is no obstacle yet.
        ((0.50, 0.27), False),
    ],
)
def test_what_stands_in_the_strip_ahead_blocks(point: tuple[float, float], expected: bool) -> None:
    assert blocked(*point) is expected


def test_mapped_things_block_only_where_they_would_be_touched_at_once() -> None:
    assert blocked(0.40, 0.0) is True
    assert blocked(0.40, 0.0, mapped=True) is False
    assert blocked(0.28, 0.0, mapped=True) is True
    assert blocked(0.20, 0.25, mapped=True) is False


def test_what_lies_beyond_the_end_of_the_way_does_not_block() -> None:
    assert blocked(0.40, 0.0, reach_m=0.05) is False


def test_an_empty_scan_blocks_nothing() -> None:
    nothing = scan_points(np.zeros(360))
    assert not is_blocked(nothing, np.zeros(0, dtype=bool), reach_m=1.0, radius_m=RADIUS_M)
