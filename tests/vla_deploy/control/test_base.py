"""Hold odometry to known arcs and the base ramp to its accelerations."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from vla_deploy.control.motion.base_motion import BaseLimits, BaseRamp
from vla_deploy.control.output.base_kinematics import DifferentialDrive
from vla_deploy.control.output.odometry import Odometry

DRIVE = DifferentialDrive(wheel_radius_m=0.1, track_m=0.4)
LIMITS = BaseLimits(
    speed_m_s=0.5,
    turn_rad_s=1.5,
    acceleration_m_s2=0.5,
    turn_acceleration_rad_s2=2.0,
    stop_deceleration_m_s2=2.4,
)
PERIOD_S = 0.004


def test_equal_wheels_drive_straight() -> None:
    odometry = Odometry(DRIVE)
    odometry.update(5.0, 7.0)
    odometry.update(6.0, 8.0)
    assert (odometry.x_m, odometry.y_m, odometry.yaw_rad) == pytest.approx((0.1, 0.0, 0.0))


def test_one_big_step_along_a_quarter_circle_is_exact() -> None:
    odometry = Odometry(DRIVE)
    odometry.update(0.0, 0.0)
    radius_m, turn = 1.0, math.pi / 2
    odometry.update((radius_m - 0.2) * turn / 0.1, (radius_m + 0.2) * turn / 0.1)
    assert (odometry.x_m, odometry.y_m, odometry.yaw_rad) == pytest.approx((1.0, 1.0, turn))


def test_yaw_wraps() -> None:
    odometry = Odometry(DRIVE)
    for step in range(8):
        odometry.update(-step * 2.0, step * 2.0)
    assert odometry.yaw_rad == pytest.approx(7.0 - math.tau)
    assert (odometry.x_m, odometry.y_m) == pytest.approx((0.0, 0.0))


def test_a_new_wheel_reference_keeps_the_pose() -> None:
    odometry = Odometry(DRIVE)
    odometry.update(0.0, 0.0)
    odometry.update(1.0, 1.0)
    odometry.forget_wheels()
    odometry.update(500.0, -500.0)
    assert (odometry.x_m, odometry.y_m, odometry.yaw_rad) == pytest.approx((0.1, 0.0, 0.0))


@given(st.floats(-2.0, 2.0), st.floats(-3.0, 3.0))
def test_wheel_speeds_and_base_velocity_are_inverse(v: float, w: float) -> None:
    assert DRIVE.base_velocity(*DRIVE.wheel_speeds(v, w)) == pytest.approx((v, w, 0.0))


def test_the_base_speeds_up_no_faster_than_allowed() -> None:
    ramp = BaseRamp(LIMITS)
    ramp.advance(0.5, 0.0, PERIOD_S)
    assert ramp.v_m_s == pytest.approx(0.5 * PERIOD_S)
    for _ in range(249):
        ramp.advance(0.5, 0.0, PERIOD_S)
    assert ramp.v_m_s == pytest.approx(0.5)


def test_speed_and_turn_reach_their_ends_together() -> None:
    ramp = BaseRamp(LIMITS)
    for _ in range(125):
        ramp.advance(0.5, 1.0, PERIOD_S)
    assert (ramp.v_m_s, ramp.w_rad_s) == pytest.approx((0.25, 0.5))


def test_the_base_comes_to_exact_rest() -> None:
    ramp = BaseRamp(LIMITS)
    for wanted in (0.3, 0.0):
        for _ in range(400):
            ramp.advance(wanted, wanted, PERIOD_S)
    assert ramp.at_rest


@given(st.lists(st.tuples(st.floats(-9.0, 9.0), st.floats(-9.0, 9.0)), max_size=40))
def test_no_command_exceeds_speed_or_acceleration(commands: list[tuple[float, float]]) -> None:
    ramp = BaseRamp(LIMITS)
    for v, w in commands:
        before = (ramp.v_m_s, ramp.w_rad_s)
        ramp.advance(v, w, PERIOD_S)
        assert abs(ramp.v_m_s) <= 0.5 + 1e-12
        assert abs(ramp.w_rad_s) <= 1.5 + 1e-12
        assert abs(ramp.v_m_s - before[0]) <= 0.5 * PERIOD_S + 1e-12
        assert abs(ramp.w_rad_s - before[1]) <= 2.0 * PERIOD_S + 1e-12


def test_halting_forgets_the_velocity() -> None:
    ramp = BaseRamp(LIMITS)
    ramp.advance(0.5, 0.5, PERIOD_S)
    ramp.halt()
    assert ramp.at_rest


def test_where_it_must_stop_it_brakes_harder_and_stays_on_its_curve() -> None:
    ramp = BaseRamp(LIMITS)
    for _ in range(2000):
        ramp.advance(0.4, 0.8, 0.004)
    before = (ramp.v_m_s, ramp.w_rad_s)
    ramp.brake(0.004)
    assert before[0] - ramp.v_m_s == pytest.approx(0.004 * LIMITS.stop_deceleration_m_s2)
    assert ramp.v_m_s / ramp.w_rad_s == pytest.approx(before[0] / before[1])
    for _ in range(200):
        ramp.brake(0.004)
    assert ramp.at_rest
