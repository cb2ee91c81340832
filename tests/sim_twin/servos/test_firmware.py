from collections.abc import Callable
from math import pi
from typing import Any

import numpy as np
import pytest

from drivers.dynamixel.codec import ALERT, Instruction, StatusError
from drivers.dynamixel.control_table import HardwareError, OperatingMode
from sim_twin.servos import EmulatedServoSpec, FirmwareOptions, ServoBank

CENTRE = 2048
QUARTER_TURN = 1024


def arm(bench: Any, mode: OperatingMode = OperatingMode.POSITION) -> None:
    assert bench.write("operating_mode", mode) == 0
    assert bench.write("torque_enable", 1) == 0


def samples(bench: Any, name: str, seconds: float, period_s: float = 0.01) -> list[int]:
    values = []
    for _ in range(round(seconds / period_s)):
        bench.run(period_s)
        values.append(bench.read(name))
    return values


# Torque and goals


def test_without_torque_there_is_no_duty_and_goals_move_nothing(bench: Any) -> None:
    assert bench.write("goal_position", CENTRE + QUARTER_TURN) == 0
    bench.run(0.5)
    assert bench.duty[0] == 0.0
    assert bench.read("present_position") == CENTRE


def test_torque_on_holds_where_a_hand_has_turned_the_shaft(bench: Any) -> None:
    bench.turn_to(0.5)
    turned = bench.read("present_position")
    arm(bench)
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
    arm(bench)
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


# Control loops


def test_a_step_runs_at_no_load_speed_and_then_settles_as_the_gain_says(bench: Any) -> None:
    """Beyond 885/6.25 = 142 pulses of error the duty is full; inside, P against back-EMF."""
    model = bench.models[0]
    arm(bench)
    bench.write("goal_position", CENTRE + QUARTER_TURN)
    bench.run(0.2)
    full = bench.read("present_velocity") * model.velocity_unit_rad_s
    assert full == pytest.approx(model.no_load_speed_rad_s, rel=0.02)
    saturated_rad = (QUARTER_TURN - 142) / 4096 * 2 * pi
    bench.run(saturated_rad / model.no_load_speed_rad_s - 0.2 + 0.25)
    assert bench.read("present_position") == pytest.approx(CENTRE + QUARTER_TURN, abs=2)
    assert bench.read("moving") == 0


def test_a_load_bends_a_p_only_servo_by_torque_over_stiffness(bench: Any) -> None:
    """Full duty at 142 pulses of error: holding 20 % of stall torque takes 28 pulses."""
    arm(bench)
    bench.write("goal_position", CENTRE)
    bench.blocked = True
    bench.turn_to(-28.3 / 4096 * 2 * pi)
    bench.run(0.01)
    assert bench.duty[0] == pytest.approx(0.2, abs=0.01)
    unit_ratio = bench.models[0].effort_unit_ratio
    assert bench.read("present_current") * unit_ratio == pytest.approx(0.2, abs=0.01)


def test_an_integral_gain_takes_the_remaining_error_away(bench: Any) -> None:
    arm(bench)
    bench.write("position_i_gain", 200)
    bench.write("goal_position", CENTRE + 10)
    bench.blocked = True
    bench.run(0.1)
    early = bench.duty[0]
    bench.run(0.4)
    assert bench.duty[0] > early + 0.01
    bench.blocked = False
    bench.run(3.0)
    assert bench.read("present_position") == pytest.approx(CENTRE + 10, abs=1)


def test_a_derivative_gain_damps_the_approach(make_bench: Callable[..., Any]) -> None:
    overshoot = []
    for gain in (0, 4000):
        bench = make_bench(["XL430-W250"], inertia_kg_m2=0.02)
        arm(bench)
        bench.write("position_d_gain", gain)
        bench.write("goal_position", CENTRE + QUARTER_TURN)
        overshoot.append(max(samples(bench, "present_position", 2.0)) - CENTRE - QUARTER_TURN)
    assert overshoot[0] > 20
    assert overshoot[1] < overshoot[0] / 4


@pytest.mark.parametrize(("register", "value"), [("goal_pwm", 200), ("pwm_limit", 200)])
def test_both_pwm_limits_bound_the_duty(bench: Any, register: str, value: int) -> None:
    bench.write("goal_pwm", 100)
    bench.write(register, value)
    if register == "pwm_limit":
        bench.write("goal_pwm", value)
    arm(bench)
    bench.write("goal_position", 0)
    assert min(samples(bench, "present_pwm", 0.5)) == -value


def test_a_profile_keeps_to_its_speed_and_acceleration(bench: Any) -> None:
    bench.write("profile_velocity", 50)
    bench.write("profile_acceleration", 10)
    arm(bench)
    bench.write("goal_position", CENTRE + QUARTER_TURN)
    speeds = samples(bench, "velocity_trajectory", 2.5)
    assert max(speeds) == 50
    ramp_s = 50 * 0.229 / (10 * 214.577 / 60)
    rising = next(index for index, speed in enumerate(speeds) if speed >= 49)
    assert rising * 0.01 == pytest.approx(ramp_s, abs=0.03)
    assert abs(bench.read("position_trajectory") - (CENTRE + QUARTER_TURN)) == 0
    assert bench.read("present_position") == pytest.approx(CENTRE + QUARTER_TURN, abs=2)


def test_a_time_based_profile_arrives_at_its_time(bench: Any) -> None:
    bench.write("drive_mode", 0x04)
    bench.write("profile_velocity", 1_000)
    bench.write("profile_acceleration", 250)
    arm(bench)
    bench.write("goal_position", CENTRE + QUARTER_TURN)
    path = samples(bench, "position_trajectory", 1.2)
    assert path[49] == pytest.approx(CENTRE + QUARTER_TURN // 2, abs=15)
    assert path[94] < CENTRE + QUARTER_TURN
    assert path[103] == CENTRE + QUARTER_TURN


def test_velocity_mode_reaches_its_goal_and_ramps_with_the_profile(bench: Any) -> None:
    arm(bench, OperatingMode.VELOCITY)
    bench.write("profile_acceleration", 5)
    bench.write("goal_velocity", -100)
    bench.run(0.5)
    asked = -0.5 * 5 * 214.577 / 60 / 0.229
    assert bench.read("velocity_trajectory") == pytest.approx(asked, abs=1)
    assert asked < bench.read("present_velocity") < asked / 2
    bench.run(2.0)
    assert bench.read("present_velocity") == pytest.approx(-100, abs=2)


def test_pwm_mode_puts_the_goal_on_the_motor(make_bench: Callable[..., Any]) -> None:
    bench = make_bench(options=FirmwareOptions(supply_ohm=0.0))
    arm(bench, OperatingMode.PWM)
    bench.write("goal_pwm", -443)
    bench.run(0.004)
    assert bench.duty[0] == pytest.approx(-443 / 885)


def test_current_mode_gives_its_torque_at_rest_and_at_speed(
    make_bench: Callable[..., Any],
) -> None:
    bench = make_bench(inertia_kg_m2=0.1)
    arm(bench, OperatingMode.CURRENT)
    bench.write("goal_current", 100)
    expected = 100 * bench.models[0].effort_unit_ratio * bench.models[0].stall_torque_nm
    for _ in range(3):
        bench.run(0.1)
        assert bench.rotors.torque_nm[0] == pytest.approx(expected, rel=0.03)
    assert bench.rotors.velocity_rad_s[0] == pytest.approx(expected / 0.1 * 0.3, rel=0.05)


def test_current_based_position_mode_pushes_no_harder_than_its_goal_current(bench: Any) -> None:
    arm(bench, OperatingMode.CURRENT_BASED_POSITION)
    bench.write("goal_current", 100)
    bench.write("goal_position", 0)
    bench.blocked = True
    bench.run(0.1)
    assert bench.read("present_current") == -100


def test_reverse_mode_mirrors_position_velocity_and_effort(bench: Any) -> None:
    bench.write("drive_mode", 0x01)
    bench.turn_to(0.25)
    assert bench.read("present_position") == CENTRE - 163
    arm(bench)
    bench.write("goal_position", CENTRE + 500)
    bench.run(0.05)
    assert bench.duty[0] < 0
    assert bench.read("present_velocity") > 0
    assert bench.read("present_pwm") > 0
    bench.run(1.0)
    assert bench.rotors.position_rad[0] == pytest.approx(-500 / 4096 * 2 * pi, abs=0.005)


def test_extended_mode_counts_turns_and_forgets_them_at_reboot(bench: Any) -> None:
    arm(bench, OperatingMode.EXTENDED_POSITION)
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


def test_different_models_run_side_by_side(make_bench: Callable[..., Any]) -> None:
    bench = make_bench(["XM540-W270", "XM430-W350", "XL430-W250", "XC430-W150"])
    for servo_id in range(1, 5):
        bench.write("torque_enable", 1, servo_id)
        bench.write("goal_position", CENTRE + 100 * servo_id, servo_id)
    bench.run(2.0)
    reached = [bench.read("present_position", servo_id) for servo_id in range(1, 5)]
    assert reached == pytest.approx([CENTRE + 100 * n for n in range(1, 5)], abs=3)


def test_the_same_inputs_give_the_same_bits(make_bench: Callable[..., Any]) -> None:
    ends = []
    for _ in range(2):
        bench = make_bench(["XM540-W270", "XL430-W250"])
        for servo_id in (1, 2):
            bench.write("torque_enable", 1, servo_id)
            bench.write("goal_position", 1_000, servo_id)
        bench.run(0.7)
        ends.append(bench.rotors.position_rad.tobytes())
    assert ends[0] == ends[1]


# Sensing


def test_the_tick_counts_milliseconds_and_wraps(bench: Any) -> None:
    start = bench.read("realtime_tick")
    bench.run(0.1)
    assert (bench.read("realtime_tick") - start) % 32_768 == 100
    bench.run(33.0)
    assert 0 <= bench.read("realtime_tick") < 32_768


def test_moving_follows_the_threshold(bench: Any) -> None:
    arm(bench)
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


# Hardware errors


def stall(bench: Any, seconds: float) -> None:
    arm(bench)
    bench.write("goal_position", 0)
    bench.blocked = True
    bench.run(seconds)


def test_a_long_stall_is_an_overload_that_cuts_torque_until_a_reboot(bench: Any) -> None:
    stall(bench, 2.8)
    assert bench.read("torque_enable") == 1
    bench.run(0.5)
    assert bench.read("torque_enable") == 0
    assert bench.duty[0] == 0.0
    assert bench.read("hardware_error_status") == HardwareError.OVERLOAD
    assert bench.write("torque_enable", 1) == ALERT
    assert bench.read("torque_enable") == 0
    bench.send(1, Instruction.REBOOT)
    bench.run(0.5)
    assert bench.read("hardware_error_status") == 0
    assert bench.write("torque_enable", 1) == StatusError.NONE
    assert bench.read("torque_enable") == 1


def test_an_error_that_shutdown_does_not_name_only_raises_the_alert(bench: Any) -> None:
    arm(bench)
    bench.supply_v = 9.0
    bench.run(0.05)
    assert bench.read("hardware_error_status") == HardwareError.INPUT_VOLTAGE
    assert bench.read("torque_enable") == 1
    assert bench.write("led", 1) == ALERT
    assert bench.read("led") == 1
    assert bench.write("led", 5) == ALERT | StatusError.DATA_RANGE


def test_overheating_cuts_torque_which_stays_off_until_a_reboot_of_a_cooler_servo(
    bench: Any,
) -> None:
    arm(bench)
    bench.bank.heat(1, 81.0)
    bench.run(0.05)
    assert bench.read("present_temperature") == 81
    assert bench.read("hardware_error_status") == HardwareError.OVERHEATING
    assert bench.read("torque_enable") == 0
    bench.bank.heat(1, 40.0)
    bench.run(0.05)
    assert bench.write("torque_enable", 1) == ALERT
    assert bench.read("torque_enable") == 0
    bench.send(1, Instruction.REBOOT)
    bench.run(0.5)
    assert bench.write("torque_enable", 1) == StatusError.NONE
    assert bench.read("torque_enable") == 1


def test_a_servo_that_is_still_hot_after_its_reboot_trips_again(bench: Any) -> None:
    bench.bank.heat(1, 90.0)
    bench.run(0.05)
    bench.send(1, Instruction.REBOOT)
    bench.run(0.5)
    bench.write("torque_enable", 1)
    bench.run(0.05)
    assert bench.read("torque_enable") == 0
    assert bench.read("hardware_error_status") == HardwareError.OVERHEATING


def test_overheating_that_shutdown_does_not_name_leaves_torque_on(
    make_bench: Callable[..., Any],
) -> None:
    bench = make_bench(eeprom={"shutdown": HardwareError.OVERLOAD})
    arm(bench)
    bench.bank.heat(1, 85.0)
    bench.run(0.05)
    assert bench.read("torque_enable") == 1
    assert bench.write("led", 1) == ALERT


def test_an_overload_from_outside_trips_and_holds_until_it_ends(bench: Any) -> None:
    arm(bench)
    bench.bank.overload(1)
    bench.run(0.05)
    assert bench.read("hardware_error_status") == HardwareError.OVERLOAD
    assert bench.read("torque_enable") == 0
    bench.bank.overload(1, on=False)
    bench.send(1, Instruction.REBOOT)
    bench.run(0.5)
    assert bench.read("hardware_error_status") == 0


def test_a_fault_from_outside_is_treated_as_one_from_inside(bench: Any) -> None:
    arm(bench)
    bench.bank.set_alert(1, HardwareError.ELECTRICAL_SHOCK)
    assert bench.read("torque_enable") == 0
    bench.run(0.01)
    assert bench.duty[0] == 0.0


# Power


def test_losing_the_supply_silences_the_bus_and_comes_back_without_torque(bench: Any) -> None:
    arm(bench)
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
    arm(bench)
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
    zeros = np.zeros(1)
    bank.advance(10**15, np.array([2 * pi + 1.0]), zeros, zeros)
    expected = CENTRE + round(1.0 / (2 * pi) * 4096)
    assert bank.register(1, "present_position") == expected
    assert bank.register(1, "goal_position") == expected
    assert bank.register(1, "hardware_error_status") == 0
