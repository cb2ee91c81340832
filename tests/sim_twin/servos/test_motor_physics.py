"""The emulated motors against the equations of their datasheet figures and registers."""

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from drivers.clock import NS_PER_S
from drivers.dynamixel.tables.control_table import MODELS, OperatingMode
from drivers.dynamixel.tables.model import PULSE_RAD, PWM_FULL
from drivers.dynamixel.wire.codec import Instruction, encode_instruction
from sim_twin.servos import EmulatedServoSpec, FirmwareOptions
from sim_twin.servos.server import FreeServos

CENTRE = 2048
PERIOD_S = 0.002
TOLERANCE = 0.03
STIFF_SUPPLY = FirmwareOptions(supply_ohm=0.0)

Floats = NDArray[np.float64]


def curve(bench: Any, name: str, seconds: float) -> Floats:
    values = []
    for _ in range(round(seconds / PERIOD_S)):
        bench.run(PERIOD_S)
        values.append(bench.read(name))
    return np.array(values, np.float64)


def linear_response(matrix: Floats, start: Floats, seconds: float) -> Floats:
    """Return the first state of x' = matrix x at every period, exactly."""
    values, vectors = np.linalg.eig(matrix)
    weights = np.linalg.solve(vectors, start.astype(complex))
    times_s = PERIOD_S * np.arange(1, round(seconds / PERIOD_S) + 1)
    modes = np.exp(np.outer(times_s, values))
    return np.asarray((modes @ (vectors[0] * weights)).real)


def start(bench: Any, mode: OperatingMode, **registers: int) -> None:
    assert bench.write("operating_mode", mode) == 0
    for name, value in registers.items():
        assert bench.write(name, value) == 0
    assert bench.write("torque_enable", 1) == 0


def position_matrix(model: Any, p_gain: int, d_gain: int, inertia_kg_m2: float) -> Floats:
    """Return inertia * a = -stall * (P + back-EMF + D), for the error in pulses and its rate."""
    stall_nm = model.stall_torque_nm
    stiffness = stall_nm * (p_gain / 128) / (PWM_FULL * PULSE_RAD)
    damping = stall_nm / model.no_load_speed_rad_s
    damping += stall_nm * (d_gain / 16) / (PWM_FULL * PULSE_RAD * 1e3)
    return np.array([[0.0, 1.0], [-stiffness / inertia_kg_m2, -damping / inertia_kg_m2]])


# Position mode


@pytest.mark.parametrize("inertia_kg_m2", [0.02, 0.05, 0.15])
@pytest.mark.parametrize("p_gain", [400, 800, 1600])
def test_a_position_step_follows_the_second_order_curve_of_its_gain_and_load(
    make_bench: Callable[..., Any], p_gain: int, inertia_kg_m2: float
) -> None:
    """Within 3 % of the step, all along the curve; the shaft is sensed at a period's start."""
    bench = make_bench(options=STIFF_SUPPLY, inertia_kg_m2=inertia_kg_m2)
    start(bench, OperatingMode.POSITION, position_p_gain=p_gain)
    step = 60
    bench.write("goal_position", CENTRE + step)
    measured = curve(bench, "present_position", 0.8) - CENTRE
    matrix = position_matrix(bench.models[0], p_gain, 0, inertia_kg_m2)
    expected = step + linear_response(matrix, np.array([-step, 0.0]), 0.8)
    assert np.abs(measured[1:] - expected[:-1]).max() < TOLERANCE * step
    wrong = step + linear_response(1.1 * matrix, np.array([-step, 0.0]), 0.8)
    assert np.abs(measured[1:] - wrong[:-1]).max() > TOLERANCE * step


@pytest.mark.parametrize("d_gain", [1000, 4000])
@pytest.mark.parametrize("model_name", ["XM430-W350", "XM540-W270", "XL430-W250"])
def test_a_released_shaft_swings_back_as_p_and_d_say(
    make_bench: Callable[..., Any], model_name: str, d_gain: int
) -> None:
    inertia_kg_m2, offset = 0.1, -50
    bench = make_bench([model_name], options=STIFF_SUPPLY, inertia_kg_m2=inertia_kg_m2)
    start(bench, OperatingMode.POSITION, position_p_gain=640, position_d_gain=d_gain)
    bench.rotors.position_rad[:] = offset * PULSE_RAD
    measured = curve(bench, "present_position", 1.0) - CENTRE
    matrix = position_matrix(bench.models[0], 640, d_gain, inertia_kg_m2)
    expected = linear_response(matrix, np.array([offset, 0.0]), 1.0)
    assert np.abs(measured[1:] - expected[:-1]).max() < TOLERANCE * abs(offset)


def test_feed_forward_of_the_speed_takes_the_lag_away(make_bench: Callable[..., Any]) -> None:
    lags = []
    for gain in (0, 1127):  # 1127 / 4 PWM per pulse/ms is the back-EMF of an XM430-W350
        bench = make_bench(options=STIFF_SUPPLY)
        start(bench, OperatingMode.POSITION, feedforward_1st_gain=gain, profile_velocity=100)
        bench.write("goal_position", CENTRE + 1500)
        bench.run(0.5)
        lags.append(bench.read("position_trajectory") - bench.read("present_position"))
    full_lag = 100 * 0.229 / 46 * PWM_FULL / (800 / 128)
    assert lags[0] == pytest.approx(full_lag, abs=4)
    assert abs(lags[1]) <= 4


def test_feed_forward_of_the_acceleration_carries_the_inertia(
    make_bench: Callable[..., Any],
) -> None:
    lags = []
    for gain in (0, 13_245):  # 885 * inertia / stall torque, per pulse/ms^2, times 4
        bench = make_bench(options=STIFF_SUPPLY)
        profile = {"profile_velocity": 200, "profile_acceleration": 40}
        gains = {"feedforward_1st_gain": 1127, "feedforward_2nd_gain": gain}
        start(bench, OperatingMode.POSITION, **gains, **profile)
        bench.write("goal_position", CENTRE + 1500)
        bench.run(0.2)
        lags.append(bench.read("position_trajectory") - bench.read("present_position"))
    assert lags[0] >= 4
    assert abs(lags[1]) < lags[0] / 2


# Velocity and current modes


@pytest.mark.parametrize("inertia_kg_m2", [0.02, 0.1])
def test_a_velocity_step_follows_the_curve_of_its_pi_gains(
    make_bench: Callable[..., Any], inertia_kg_m2: float
) -> None:
    bench = make_bench(options=STIFF_SUPPLY, inertia_kg_m2=inertia_kg_m2)
    start(bench, OperatingMode.VELOCITY)
    goal = 80
    bench.write("goal_velocity", goal)
    measured = curve(bench, "present_velocity", 1.5)
    model = bench.models[0]
    per_pwm = model.stall_torque_nm / (PWM_FULL * inertia_kg_m2 * model.velocity_unit_rad_s)
    back_emf = model.stall_torque_nm / (model.no_load_speed_rad_s * inertia_kg_m2)
    p_gain, i_gain = 100 / 128, 1920 / 65_536 * 1e3
    # The states are velocity - goal and (integral - its last value) of the error.
    matrix = np.array([[-per_pwm * p_gain - back_emf, per_pwm * i_gain], [-1.0, 0.0]])
    last_integral = goal * back_emf / (per_pwm * i_gain)
    expected = goal + linear_response(matrix, np.array([-goal, -last_integral]), 1.5)
    assert np.abs(measured[1:] - expected[:-1]).max() < TOLERANCE * goal


@pytest.mark.parametrize("supply_v", [12.0, 10.5])
def test_current_mode_keeps_its_torque_at_any_voltage_and_speed(
    make_bench: Callable[..., Any], supply_v: float
) -> None:
    bench = make_bench(inertia_kg_m2=0.1)
    bench.supply_v = supply_v
    start(bench, OperatingMode.CURRENT)
    bench.write("goal_current", 150)
    model = bench.models[0]
    expected_nm = 150 * model.effort_unit_ratio * model.stall_torque_nm
    seen = curve(bench, "present_current", 0.15)
    assert bench.rotors.torque_nm[0] == pytest.approx(expected_nm, rel=0.03)
    assert np.abs(seen[10:] - 150).max() <= 5
    assert bench.rotors.velocity_rad_s[0] == pytest.approx(expected_nm / 0.1 * 0.15, rel=0.05)


# Supply


def test_voltage_falls_with_the_current_of_all_servos(make_bench: Callable[..., Any]) -> None:
    """A stalled XM430-W350 is 12 V / 2.3 A: in series with 0.5 ohm each of two takes its share."""
    bench = make_bench(["XM430-W350"] * 2, options=FirmwareOptions(supply_ohm=0.5))
    bench.blocked = True
    expected_v = []
    for servo_id in (1, 2):
        bench.write("operating_mode", OperatingMode.PWM, servo_id)
        bench.write("torque_enable", 1, servo_id)
        bench.run(0.05)
        expected_v.append(12.0 / (1.0 + 0.5 * servo_id * 2.3 / 12.0))
        measured_v = bench.read("present_input_voltage") / 10
        assert measured_v == pytest.approx(expected_v[-1], abs=0.06)
    assert bench.duty == pytest.approx(expected_v[-1] / 12.0, rel=1e-3)


def test_a_weak_supply_browns_out_under_load_and_the_servos_come_back_limp(
    make_bench: Callable[..., Any],
) -> None:
    bench = make_bench(["XM430-W350"] * 4, options=FirmwareOptions(supply_ohm=3.0))
    bench.blocked = True
    for servo_id in range(1, 5):
        bench.write("operating_mode", OperatingMode.PWM, servo_id)
        bench.write("torque_enable", 1, servo_id)
    bench.run(0.1)
    assert bench.duty.tolist() == [0.0] * 4
    bench.run(0.4)
    assert [bench.read("torque_enable", servo_id) for servo_id in range(1, 5)] == [0] * 4


def test_braking_motors_do_not_raise_the_voltage(make_bench: Callable[..., Any]) -> None:
    bench = make_bench(options=FirmwareOptions(supply_ohm=1.0), inertia_kg_m2=1.0)
    start(bench, OperatingMode.PWM, goal_pwm=400)
    bench.rotors.velocity_rad_s[:] = 4.0
    bench.run(0.022)
    assert bench.rotors.torque_nm[0] < -0.5
    assert bench.read("present_input_voltage") == 120


# What the models sense


@pytest.mark.parametrize(
    ("model_name", "expected"),
    [("XM430-W350", 0.5 * 2300 / 2.69), ("XL430-W250", 500.0), ("XL330-M288", 0.25 * 1470)],
)
def test_a_stall_at_half_duty_shows_as_each_model_senses_it(
    make_bench: Callable[..., Any], model_name: str, expected: float
) -> None:
    """XM430: motor current; XL430: load; XL330: current drawn from the supply, half as much."""
    bench = make_bench([model_name], options=STIFF_SUPPLY)
    start(bench, OperatingMode.PWM, goal_pwm=-round(PWM_FULL / 2))
    bench.blocked = True
    bench.run(0.1)
    name = "present_load" if model_name == "XL430-W250" else "present_current"
    assert bench.read(name) == pytest.approx(-expected, rel=0.01)


def test_a_free_running_motor_reaches_the_speed_of_its_datasheet(
    make_bench: Callable[..., Any],
) -> None:
    bench = make_bench(["XM430-W210"], options=STIFF_SUPPLY)
    start(bench, OperatingMode.PWM, goal_pwm=PWM_FULL)
    bench.run(0.5)
    assert bench.read("present_velocity") * 0.229 == pytest.approx(77, abs=0.5)
    assert bench.read("present_current") == pytest.approx(0, abs=2)
    assert math.isclose(bench.rotors.velocity_rad_s[0], 77 * math.tau / 60, rel_tol=0.01)


@pytest.mark.parametrize("model_name", MODELS)
def test_a_free_running_servo_of_each_model_settles_with_factory_gains(model_name: str) -> None:
    """The weakest and fastest, XL330-M077, has an I gain as delivered, and takes the longest."""
    servos = FreeServos([EmulatedServoSpec(id=1, model_name=model_name)])
    bank, register = servos.bank, MODELS[model_name].registers
    servos.advance_to(NS_PER_S)
    for name, value in (("torque_enable", 1), ("goal_position", 2560)):
        row = register[name]
        params = row.address.to_bytes(2, "little") + row.to_bytes(value)
        bank.receive(encode_instruction(1, Instruction.WRITE, params))
    errors = []
    for tick in range(1, 101):
        servos.advance_to(NS_PER_S + tick * NS_PER_S // 50)
        errors.append(abs(bank.register(1, "present_position") - 2560))
    assert max(errors[50:]) <= 4
