from math import pi
from typing import Any

import pytest

from drivers.dynamixel.tables.control_table import OperatingMode
from drivers.dynamixel.wire.codec import Instruction

CENTRE = 2048


def test_reverse_mode_mirrors_position_velocity_and_effort(bench: Any) -> None:
    bench.write("drive_mode", 0x01)
    bench.turn_to(0.25)
    assert bench.read("present_position") == CENTRE - 163
    bench.arm()
    bench.write("goal_position", CENTRE + 500)
    bench.run(0.05)
    assert bench.duty[0] < 0
    assert bench.read("present_velocity") > 0
    assert bench.read("present_pwm") > 0
    bench.run(1.0)
    assert bench.rotors.position_rad[0] == pytest.approx(-500 / 4096 * 2 * pi, abs=0.005)


def test_extended_mode_counts_turns_and_forgets_them_at_reboot(bench: Any) -> None:
    bench.arm(OperatingMode.EXTENDED_POSITION)
    bench.write("goal_position", CENTRE + 3 * 4096)
    bench.run(6.0)
    assert bench.read("present_position") == pytest.approx(CENTRE + 3 * 4096, abs=2)
    bench.send(1, Instruction.REBOOT)
    bench.run(0.5)
    assert bench.read("present_position") == pytest.approx(CENTRE, abs=2)


def test_a_homing_offset_shifts_the_present_position(bench: Any) -> None:
    bench.write("homing_offset", -500)
    bench.run(0.01)
    assert bench.read("present_position") == CENTRE - 500


def test_the_encoder_has_4096_steps_per_turn(bench: Any) -> None:
    step_rad = 2 * pi / 4096
    bench.turn_to(0.4 * step_rad)
    assert bench.read("present_position") == CENTRE
    bench.turn_to(0.6 * step_rad)
    assert bench.read("present_position") == CENTRE + 1


def test_the_tick_counts_milliseconds_and_wraps(bench: Any) -> None:
    start = bench.read("realtime_tick")
    bench.run(0.1)
    assert (bench.read("realtime_tick") - start) % 32_768 == 100
    bench.run(33.0)
    assert 0 <= bench.read("realtime_tick") < 32_768


def test_moving_follows_the_threshold(bench: Any) -> None:
    bench.arm()
    assert bench.read("moving") == 0
    bench.write("goal_position", 0)
    bench.run(0.1)
    assert bench.read("moving") == 1
    assert bench.read("moving_status") & 0x01 == 0
    bench.run(2.0)
    assert (bench.read("moving"), bench.read("moving_status") & 0x01) == (0, 1)


def test_the_supply_shows_in_tenths_of_a_volt(bench: Any) -> None:
    bench.supply_v = 11.34
    bench.run(0.01)
    assert bench.read("present_input_voltage") == 113
