"""Temperatures against the constants that `sim_twin.servos.firmware.thermal` documents."""

from typing import Any

import numpy as np
import pytest

from drivers.dynamixel.tables.control_table import OperatingMode
from drivers.dynamixel.tables.models import MODELS
from drivers.servo.hardware_error import HardwareError
from sim_twin.servos.firmware.thermal import (
    WINDING_SHARE,
    WINDING_TIME_CONSTANT_S,
    Thermals,
    body_of,
)

AMBIENT_C = 25.0
STEP_S = 0.1
XM430 = MODELS["XM430-W350"]


def heated(effort_ratio: float, seconds: float, model_name: str = "XM430-W350") -> Thermals:
    thermals = Thermals([MODELS[model_name]], AMBIENT_C)
    for _ in range(round(seconds / STEP_S)):
        thermals.advance(np.array([effort_ratio]), STEP_S)
    return thermals


def test_every_model_has_a_body() -> None:
    for model in MODELS.values():
        assert 15.0 < body_of(model).mass_g < 200.0


def test_an_xm430_stores_66_joules_per_kelvin_and_gives_a_tenth_of_a_watt_to_the_air() -> None:
    body = body_of(XM430)
    assert body.heat_capacity_j_k == pytest.approx(65.6)
    assert body.cooling_w_k == pytest.approx(0.0930, abs=1e-4)


def test_heat_goes_with_the_square_of_the_current() -> None:
    rises = [heated(effort, 1.0).winding_c[0] - AMBIENT_C for effort in (0.2, 0.4, -0.4)]
    assert rises[1] == pytest.approx(4.0 * rises[0], rel=1e-6)
    assert rises[2] == pytest.approx(rises[1])


def test_after_the_windings_lag_the_body_warms_at_power_over_capacity() -> None:
    effort, power_w = 0.5, 12.0 * 2.3 * 0.25
    early, late = heated(effort, 60.0), heated(effort, 70.0)
    lost_w = body_of(XM430).cooling_w_k * (late.body_c[0] - AMBIENT_C)
    rate_k_s = (power_w - lost_w) / body_of(XM430).heat_capacity_j_k
    assert (late.body_c[0] - early.body_c[0]) / 10.0 == pytest.approx(rate_k_s, rel=0.03)
    above_k = late.winding_c[0] - late.body_c[0]
    winding_j_k = body_of(XM430).heat_capacity_j_k * WINDING_SHARE
    expected_k = power_w * (1 - WINDING_SHARE) * WINDING_TIME_CONSTANT_S / winding_j_k
    assert above_k == pytest.approx(expected_k, rel=0.05)


def test_in_the_end_the_air_takes_what_the_motor_gives() -> None:
    power_w = 12.0 * 2.3 * 0.3**2
    rise_k = heated(0.3, 5_000.0).body_c[0] - AMBIENT_C
    assert rise_k == pytest.approx(power_w / body_of(XM430).cooling_w_k, rel=0.01)


def test_a_servo_cools_towards_the_air() -> None:
    thermals = heated(0.0, 0.0)
    thermals.heat(0, 70.0)
    time_constant_s = body_of(XM430).heat_capacity_j_k / body_of(XM430).cooling_w_k
    for _ in range(round(time_constant_s / STEP_S)):
        thermals.advance(np.zeros(1), STEP_S)
    assert thermals.body_c[0] - AMBIENT_C == pytest.approx(45.0 / np.e, rel=0.03)


def test_a_held_load_heats_an_emulated_servo_at_the_documented_rate(bench: Any) -> None:
    """Blocked at 60 % duty: 12 V x 2.3 A x 0.36 = 9.9 W, less what the supply's sag takes."""
    bench.write("operating_mode", OperatingMode.PWM)
    bench.write("goal_pwm", 531)
    bench.write("torque_enable", 1)
    bench.blocked = True
    bench.run(40.0)
    before_c = bench.read("present_temperature")
    bench.run(60.0)
    rise_k = bench.read("present_temperature") - before_c
    effort = bench.rotors.torque_nm[0] / XM430.stall_torque_nm
    power_w = 12.0 * 2.3 * effort**2
    mean_loss_w = body_of(XM430).cooling_w_k * (before_c + rise_k / 2 - AMBIENT_C)
    expected_k = 60.0 * (power_w - mean_loss_w) / body_of(XM430).heat_capacity_j_k
    assert rise_k == pytest.approx(expected_k, abs=1.0)


def test_a_held_load_heats_a_servo_until_it_trips_and_cools_without_torque(bench: Any) -> None:
    bench.bank.heat(1, 79.0)
    bench.write("operating_mode", OperatingMode.PWM)
    bench.write("goal_pwm", 680)
    bench.write("torque_enable", 1)
    bench.blocked = True
    bench.run(30.0)
    assert bench.read("hardware_error_status") == HardwareError.OVERHEATING
    assert bench.read("torque_enable") == 0
    assert bench.duty[0] == 0.0
    hot_c = bench.read("present_temperature")
    bench.run(30.0)
    assert bench.read("present_temperature") < hot_c
