"""Hold what remains of a wanted base velocity under a speed ratio and blocked motions."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from vla_deploy.control.motion.base_motion import BaseLimits, permitted
from vla_deploy.control.motion.base_velocity import BaseVelocity
from vla_deploy.safety import Direction

LIMITS = BaseLimits(
    speed_m_s=0.5,
    turn_rad_s=1.5,
    acceleration_m_s2=0.6,
    turn_acceleration_rad_s2=2.5,
    stop_deceleration_m_s2=2.4,
)
FORWARD, BACKWARD, LEFT, RIGHT = Direction
speeds = st.floats(-2.0, 2.0, allow_nan=False)
ratios = st.floats(0.0, 1.0)


@pytest.mark.parametrize(
    ("wanted", "blocked", "left"),
    [
        ((0.3, 0.2), (), (0.3, 0.2)),
        ((0.3, 0.2), (FORWARD,), (0.0, 0.2)),
        ((-0.3, 0.2), (FORWARD,), (-0.3, 0.2)),
        ((-0.3, 0.2), (BACKWARD,), (0.0, 0.2)),
        ((0.3, 0.2), (LEFT,), (0.3, 0.0)),
        ((0.3, -0.2), (LEFT,), (0.3, -0.2)),
        ((0.3, -0.2), (RIGHT,), (0.3, 0.0)),
        ((0.3, -0.2), tuple(Direction), (0.0, 0.0)),
        ((0.0, 0.0), tuple(Direction), (0.0, 0.0)),
    ],
)
def test_a_blocked_motion_is_taken_out_and_its_opposite_stays(
    wanted: tuple[float, float], blocked: tuple[Direction, ...], left: tuple[float, float]
) -> None:
    assert permitted(BaseVelocity(*wanted), LIMITS, 1.0, blocked) == BaseVelocity(*left)


def test_a_slow_motion_is_not_slowed_further() -> None:
    assert permitted(BaseVelocity(0.1), LIMITS, 0.2, ()) == BaseVelocity(0.1)


def test_the_base_slows_down_on_its_curve() -> None:
    v_m_s, w_rad_s, _ = permitted(BaseVelocity(0.5, 0.3), LIMITS, 0.5, ())
    assert v_m_s == pytest.approx(0.25)
    assert w_rad_s == pytest.approx(0.15)


@given(speeds, speeds, ratios, st.sets(st.sampled_from(list(Direction))))
def test_nothing_permitted_is_blocked_or_above_the_ratio(
    v_m_s: float, w_rad_s: float, ratio: float, blocked: set[Direction]
) -> None:
    left_v, left_w, _ = permitted(BaseVelocity(v_m_s, w_rad_s), LIMITS, ratio, blocked)
    assert abs(left_v) <= ratio * LIMITS.speed_m_s + 1e-9
    assert abs(left_w) <= ratio * LIMITS.turn_rad_s + 1e-9
    assert not (left_v > 0 and FORWARD in blocked) and not (left_v < 0 and BACKWARD in blocked)
    assert not (left_w > 0 and LEFT in blocked) and not (left_w < 0 and RIGHT in blocked)
    assert left_v * v_m_s >= 0.0
    assert left_w * w_rad_s >= 0.0
