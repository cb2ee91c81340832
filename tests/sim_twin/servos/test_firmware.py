"""What a servo does with torque, goals, its supply and its boot, and what its sensors show."""

from math import pi
from typing import Any

import numpy as np
import pytest

from drivers.dynamixel.tables.control_table import OperatingMode
from drivers.dynamixel.wire.codec import Instruction
from sim_twin.servos import EmulatedServoSpec, ServoBank

CENTRE = 2048


def test_losing_the_supply_silences_the_bus_and_comes_back_without_torque(bench: Any) -> None:
    bench.arm()
    bench.write("goal_position", CENTRE + 100)
    bench.supply_v = 0.0
    bench.run(0.01)
    assert bench.duty[0] == 0.0
    assert bench.send(1, Instruction.PING) == []
    bench.supply_v = 12.0
    bench.run(0.1)
    assert bench.send(1, Instruction.PING) == []
    bench.run(0.15)
    assert bench.read("torque_enable") == 0
    assert bench.read("goal_position") == bench.read("present_position")


def test_a_reboot_answers_then_is_silent_for_its_boot_time(bench: Any) -> None:
    bench.arm()
    assert bench.send(1, Instruction.REBOOT)[0].error == 0
    bench.run(0.19)
    assert bench.send(1, Instruction.PING) == []
    assert bench.duty[0] == 0.0
    bench.run(0.02)
    assert len(bench.send(1, Instruction.PING)) == 1
    assert bench.read("torque_enable") == 0


def test_startup_configuration_can_switch_torque_on(bench: Any) -> None:
    bench.write("startup_configuration", 1)
    bench.send(1, Instruction.REBOOT)
    bench.run(0.3)
    assert bench.read("torque_enable") == 1


def test_servos_wake_up_where_they_are_and_count_from_the_first_turn() -> None:
    bank = ServoBank([EmulatedServoSpec(id=1, model_name="XM430-W350")])
    bank.advance(10**15, np.array([[2 * pi + 1.0], [0.0]]), np.zeros(1))
    expected = CENTRE + round(1.0 / (2 * pi) * 4096)
    assert bank.register(1, "present_position") == expected
    assert bank.register(1, "goal_position") == expected
    assert bank.register(1, "hardware_error_status") == 0


QUARTER_TURN = 1024


def test_without_torque_there_is_no_duty_and_goals_move_nothing(bench: Any) -> None:
    assert bench.write("goal_position", CENTRE + QUARTER_TURN) == 0
    bench.run(0.5)
    assert bench.duty[0] == 0.0
    assert bench.read("present_position") == CENTRE


def test_torque_on_holds_where_a_hand_has_turned_the_shaft(bench: Any) -> None:
    bench.turn_to(0.5)
    turned = bench.read("present_position")
    bench.arm()
    assert bench.read("goal_position") == turned == CENTRE + round(0.5 / (2 * pi) * 4096)
    bench.run(0.5)
    assert bench.read("present_position") == turned


def test_torque_on_follows_a_goal_that_was_written_while_torque_was_off(bench: Any) -> None:
    bench.write("goal_position", CENTRE + 300)
    bench.write("torque_enable", 1)
    bench.run(1.0)
    assert bench.read("present_position") == pytest.approx(CENTRE + 300, abs=2)
    bench.write("torque_enable", 0)
    bench.turn_to(0.0)
    bench.write("torque_enable", 1)
    assert bench.read("goal_position") == CENTRE


def test_writing_torque_on_again_leaves_the_goal_alone(bench: Any) -> None:
    bench.arm()
    bench.write("goal_position", CENTRE + 500)
    bench.run(0.02)
    bench.write("torque_enable", 1)
    assert bench.read("goal_position") == CENTRE + 500


def test_a_goal_can_switch_torque_on_where_the_drive_mode_says_so(bench: Any) -> None:
    bench.write("drive_mode", 0x08)
    bench.write("goal_position", CENTRE + 100)
    assert bench.read("torque_enable") == 1
    bench.run(1.0)
    assert bench.read("present_position") == pytest.approx(CENTRE + 100, abs=2)


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
