"""Three omni wheels: what they turn for a velocity of the base, and what they tell of it."""

from math import cos, hypot, pi, radians, sin

import pytest
from hypothesis import given
from hypothesis import strategies as st

from vla_deploy.control.motion.base_motion import BaseRamp, base_limits, permitted
from vla_deploy.control.motion.base_velocity import BaseVelocity
from vla_deploy.control.output.base_kinematics import OmniDrive, within_wheels
from vla_deploy.control.output.odometry import Odometry
from vla_deploy.robots import load_robot
from vla_deploy.safety import Direction

DRIVE = OmniDrive(
    wheel_radius_m=0.05,
    base_radius_m=0.125,
    bearings_rad=(radians(60), radians(180), radians(-60)),
)
LIMITS = base_limits(load_robot("lekiwi"))
PERIOD_S = 0.004
speeds = st.floats(-0.5, 0.5)
velocities = st.builds(BaseVelocity, speeds, st.floats(-2.0, 2.0), speeds)


def lerobot_wheels(velocity: BaseVelocity) -> list[float]:
    """Return what LeRobot's LeKiwi sends, in rad/s: left, back, right."""
    angles = [radians(one - 90.0) for one in (240.0, 0.0, 120.0)]
    x, theta, y = velocity
    return [(cos(one) * x + sin(one) * y + 0.125 * theta) / 0.05 for one in angles]


@given(velocities)
def test_wheels_turn_as_lerobot_reckons_and_tell_the_velocity(velocity: BaseVelocity) -> None:
    wheels = DRIVE.wheel_speeds(*velocity)
    assert wheels == pytest.approx(lerobot_wheels(velocity), abs=1e-9)
    assert DRIVE.base_velocity(*wheels) == pytest.approx(velocity, abs=1e-9)


@given(velocities)
def test_no_wheel_is_too_fast_and_the_curve_stays(velocity: BaseVelocity) -> None:
    left = within_wheels(velocity, DRIVE, 4.0)
    wheels = DRIVE.wheel_speeds(*left)
    assert max(map(abs, wheels)) <= 4.0 + 1e-9
    full = DRIVE.wheel_speeds(*velocity)
    share = min(1.0, 4.0 / max(4.0, *map(abs, full)))
    assert wheels == pytest.approx([share * one for one in full], abs=1e-9)


def test_more_than_three_wheels_agree_in_the_middle() -> None:
    bearings = tuple(radians(one) for one in (45, 135, -135, -45))
    drive = OmniDrive(wheel_radius_m=0.05, base_radius_m=0.2, bearings_rad=bearings)
    wheels = drive.wheel_speeds(0.1, 0.5, -0.2)
    assert drive.base_velocity(*wheels) == pytest.approx((0.1, 0.5, -0.2))
    slipping = (wheels[0] + 0.1, *wheels[1:])
    assert drive.base_velocity(*slipping) == pytest.approx((0.1, 0.5, -0.2), abs=0.01)


@pytest.mark.parametrize(
    ("velocity", "pose"),
    [
        (BaseVelocity(0.0, 0.0, 0.1), (0.0, 0.2, 0.0)),
        # a quarter of a circle to the left of where it looks, while it turns along
        (BaseVelocity(0.0, 0.25 * pi, 0.05 * pi), (-0.2, 0.2, 0.5 * pi)),
        (BaseVelocity(0.1, 0.0, -0.1), (0.2, -0.2, 0.0)),
    ],
)
def test_the_way_is_added_up_exactly(
    velocity: BaseVelocity, pose: tuple[float, float, float]
) -> None:
    odometry, wheels = Odometry(DRIVE), DRIVE.wheel_speeds(*velocity)
    for time_s in (0.0, 1.3, 2.0):
        odometry.update(*(time_s * one for one in wheels))
    assert (odometry.x_m, odometry.y_m, odometry.yaw_rad) == pytest.approx(pose)


def test_sideways_it_speeds_up_no_faster_and_goes_no_faster_than_ahead() -> None:
    ramp = BaseRamp(LIMITS)
    ramp.advance(0.0, 0.0, PERIOD_S, 9.0)
    assert ramp.velocity == pytest.approx((0.0, 0.0, LIMITS.acceleration_m_s2 * PERIOD_S))
    for _ in range(2000):
        ramp.advance(3.0, 0.0, PERIOD_S, 4.0)
    assert hypot(ramp.v_m_s, ramp.velocity.left_m_s) == pytest.approx(LIMITS.speed_m_s)
    assert ramp.velocity.left_m_s == pytest.approx(0.8 * LIMITS.speed_m_s)


def test_it_goes_nowhere_sideways_while_anything_is_blocked() -> None:
    wanted = BaseVelocity(0.1, 0.0, 0.1)
    assert permitted(wanted, LIMITS, 1.0, ()) == wanted
    assert permitted(wanted, LIMITS, 1.0, (Direction.TURN_LEFT,)) == BaseVelocity(0.1)
    slowed = permitted(wanted, LIMITS, 0.5, ())
    assert slowed.speed_m_s == pytest.approx(0.5 * LIMITS.speed_m_s)
