import pytest
from hypothesis import given
from hypothesis import strategies as st

from sim_twin.can.cia402.velocity_loop import VelocityLoop, ramp_towards

VELOCITY = st.floats(-50.0, 50.0)
STEP = st.floats(0.001, 10.0)


def test_the_integral_does_not_wind_up_while_the_torque_saturates() -> None:
    loop = VelocityLoop(kv=2.0, ki=20.0)
    for _ in range(1000):
        assert loop.torque_nm(10.0, 0.002, -4.0, 4.0) == 4.0
    assert loop.saturated
    assert loop.torque_nm(-1.0, 0.002, -4.0, 4.0) == pytest.approx(-2.0)


def test_the_integral_takes_a_constant_load() -> None:
    loop = VelocityLoop(kv=2.0, ki=20.0)
    for _ in range(500):
        torque_nm = loop.torque_nm(0.1, 0.002, -4.0, 4.0)
    assert torque_nm == pytest.approx(0.2 + 20.0 * 0.1 * 0.002 * 499)


@given(present=VELOCITY, target=VELOCITY, up=STEP, down=STEP)
def test_a_ramp_arrives_without_overshoot(
    present: float, target: float, up: float, down: float
) -> None:
    moved = ramp_towards(present, target, up, down)
    assert min(present, target) <= moved <= max(present, target)
    assert abs(moved - present) <= max(up, down) * (1 + 1e-9) + 1e-9
    assert moved == target or abs(moved - present) >= min(up, down) * (1 - 1e-9) - 1e-9


@pytest.mark.parametrize(
    ("present", "target", "expected"),
    [(1.0, 5.0, 2.0), (5.0, 1.0, 2.0), (-1.0, -5.0, -2.0), (-5.0, 5.0, -2.0), (0.0, 5.0, 1.0)],
)
def test_speeding_up_and_slowing_down_have_their_own_steps(
    present: float, target: float, expected: float
) -> None:
    assert ramp_towards(present, target, 1.0, 3.0) == expected
