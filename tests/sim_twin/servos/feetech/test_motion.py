"""Modes, limits and the traps of goals."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from drivers.feetech.codec import FeetechInstruction, encode_packet
from drivers.feetech.table import FEETECH_MODELS, STEP_RAD, FeetechMode
from sim_twin.servos import Coupling
from sim_twin.servos.feetech import EmulatedFeetechSpec, FeetechBank

NO_LOAD_STEP_S = 45 / 60 * 4096


@pytest.mark.parametrize("model", FEETECH_MODELS)
def test_every_model_reaches_its_goal_within_its_dead_zone(
    make_bench: Callable[..., Any], model: str
) -> None:
    bench = make_bench([model])
    bench.write("torque_enable", 1)
    bench.write("goal_position", 300)
    bench.run(1.5)
    assert abs(bench.read("present_position") - 300) <= 2
    assert bench.read("moving") == 0


def test_speed_and_acceleration_lead_to_the_goal(bench: Any) -> None:
    bench.write("torque_enable", 1)
    bench.write("acceleration", 10)  # 1000 step/s^2
    bench.write("goal_velocity", 500)
    bench.write("goal_position", 3048)
    bench.run(0.25)
    assert abs(bench.read("present_velocity") - 250) < 40
    bench.run(0.75)
    assert abs(bench.read("present_velocity") - 500) < 20
    assert abs(bench.read("present_position") - (2048 + 125 + 250)) < 15  # after 0.5 s of ramp
    assert bench.read("moving") == 1


def test_torque_that_is_switched_on_goes_to_the_old_goal(bench: Any) -> None:
    bench.turn_to(1000)
    assert bench.read("goal_position") == 2048
    bench.write("torque_enable", 1)
    bench.run(1.0)
    assert abs(bench.read("present_position") - 2048) <= 2


@pytest.mark.parametrize("goal", [-500, 100, 5000])
def test_the_position_limits_bound_what_is_gone_to_and_not_what_is_kept(
    bench: Any, goal: int
) -> None:
    bench.write("min_position_limit", 1000)
    bench.write("max_position_limit", 3000)
    bench.write("torque_enable", 1)
    bench.write("goal_position", goal)
    bench.run(1.0)
    expected = min(max(goal, 1000), 3000)
    assert abs(bench.read("present_position") - expected) <= 2
    assert bench.read("target_position") == expected
    assert bench.read("goal_position") == goal


@pytest.mark.parametrize(("phase", "shown"), [(12, 904), (12 | 0x10, 5000)])
def test_positions_wrap_at_one_turn_unless_phase_asks_for_more(
    make_bench: Callable[..., Any], phase: int, shown: int
) -> None:
    bench = make_bench(eeprom={"phase": phase, "min_position_limit": 0, "max_position_limit": 0})
    bench.write("torque_enable", 1)
    bench.write("goal_position", 5000)
    bench.run(2.5)
    assert abs(bench.read("present_position") - shown) <= 2
    assert abs(bench.rotors.position_rad[0] / bench.models[0].step_rad - (5000 - 2048)) <= 2
    bench.write("torque_enable", 0)
    assert len(bench.send(1, FeetechInstruction.RESET_STATE)) == 1
    bench.run(0.01)
    assert abs(bench.read("present_position") - 904) <= 2


def test_a_position_below_zero_has_its_sign_in_bit_15(make_bench: Callable[..., Any]) -> None:
    bench = make_bench(eeprom={"phase": 12 | 0x10})
    bench.turn_to(-5)
    (reply,) = bench.send(1, FeetechInstruction.READ, b"\x38\x02")
    assert reply.params == b"\x05\x80"


def test_a_servo_can_be_reversed_by_phase(make_bench: Callable[..., Any]) -> None:
    bench = make_bench(eeprom={"phase": 12 | 0x81})
    bench.write("torque_enable", 1)
    bench.write("goal_position", 2500)
    bench.run(1.0)
    assert abs(bench.read("present_position") - 2500) <= 2
    assert bench.rotors.position_rad[0] < 0.0


@pytest.mark.parametrize("goal", [-1500, 800])
def test_velocity_mode_holds_a_speed(bench: Any, goal: int) -> None:
    bench.write("operating_mode", FeetechMode.VELOCITY)
    bench.write("torque_enable", 1)
    bench.write("goal_velocity", goal)
    bench.run(1.5)
    assert abs(bench.read("present_velocity") - goal) < 0.03 * abs(goal)


@pytest.mark.parametrize(("limit", "load"), [(1000, -600), (200, -200)])
def test_pwm_mode_puts_its_duty_on_the_motor_up_to_the_torque_limit(
    bench: Any, limit: int, load: int
) -> None:
    bench.write("operating_mode", FeetechMode.PWM)
    bench.write("torque_limit", limit)
    bench.write("torque_enable", 1)
    bench.write("goal_time", -600)
    bench.run(0.5)
    assert bench.read("present_load") == load
    assert abs(bench.read("present_velocity") - load / 1000 * NO_LOAD_STEP_S) < 30


def test_step_mode_goes_on_by_each_goal(bench: Any) -> None:
    bench.write("operating_mode", FeetechMode.STEP)
    bench.write("torque_enable", 1)
    for _ in range(3):
        bench.write("goal_position", -1000)
    bench.run(2.0)
    assert abs(bench.rotors.position_rad[0] / bench.models[0].step_rad + 3000) <= 2


def test_integral_gain_removes_the_error_under_load(bench: Any) -> None:
    def error_under_load(i_gain: int) -> float:
        bench.write("position_i_gain", i_gain)
        bench.write("goal_position", 2048)
        for _ in range(1500):
            bench.rotors.velocity_rad_s[:] -= 0.3  # a weight of 1.5 N m on 0.01 kg m^2
            bench.run(0.002)
        return float(abs(bench.read("present_position") - 2048))

    bench.write("overload_torque", 100)
    bench.write("torque_enable", 1)
    assert 15 < error_under_load(0) < 35
    assert error_under_load(32) <= 3


def test_a_host_that_falls_silent_changes_nothing(bench: Any) -> None:
    bench.write("torque_enable", 1)
    bench.write("goal_velocity", 100)
    bench.write("goal_position", 3000)
    bench.run(10.0)
    assert abs(bench.read("present_position") - 3000) <= 2
    assert bench.read("torque_enable") == 1


def test_joints_turn_as_their_coupling_says() -> None:
    coupling = Coupling(rad_per_joint=np.array([1.0, -2.0]), zero_rad=np.array([0.1, 0.0]))
    specs = [EmulatedFeetechSpec(id=n, model_name="STS3215-C018") for n in (1, 2)]
    bank = FeetechBank(specs, coupling=coupling)
    bank.advance(2_000_000, np.array([[0.5, 0.5], [0.0, 0.0]]), np.zeros(2))
    shown = [bank.register(n, "present_position") for n in (1, 2)]
    assert shown == [2048 + round(0.4 / STEP_RAD), 2048 - round(1.0 / STEP_RAD)]
    bank.receive(encode_packet(254, FeetechInstruction.WRITE, b"\x28\x01"))
    bank.receive(encode_packet(254, FeetechInstruction.WRITE, b"\x2a\x00\x0c"))
    duty = bank.advance(4_000_000, np.array([[0.5, 0.5], [0.0, 0.0]]), np.zeros(2))
    assert duty.tolist() == pytest.approx([1.0, -1.0], abs=0.01)
