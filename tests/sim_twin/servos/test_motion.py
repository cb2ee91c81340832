from collections.abc import Callable
from math import pi
from typing import Any

import pytest

from drivers.dynamixel.tables.control_table import OperatingMode

CENTRE = 2048
QUARTER_TURN = 1024


def test_a_step_runs_at_no_load_speed_and_then_settles_as_the_gain_says(bench: Any) -> None:
    """Beyond 885/6.25 = 142 pulses of error the duty is full; inside, P against back-EMF."""
    model = bench.models[0]
    bench.arm()
    bench.write("goal_position", CENTRE + QUARTER_TURN)
    bench.run(0.2)
    full = bench.read("present_velocity") * model.velocity_unit_rad_s
    assert full == pytest.approx(model.no_load_speed_rad_s, rel=0.02)
    saturated_rad = (QUARTER_TURN - 142) / 4096 * 2 * pi
    bench.run(saturated_rad / model.no_load_speed_rad_s - 0.2 + 0.25)
    assert bench.read("present_position") == pytest.approx(CENTRE + QUARTER_TURN, abs=2)
    assert bench.read("moving") == 0


def test_an_integral_gain_takes_the_remaining_error_away(bench: Any) -> None:
    bench.arm()
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
        bench.arm()
        bench.write("position_d_gain", gain)
        bench.write("goal_position", CENTRE + QUARTER_TURN)
        overshoot.append(max(bench.samples("present_position", 2.0)) - CENTRE - QUARTER_TURN)
    assert overshoot[0] > 20
    assert overshoot[1] < overshoot[0] / 4


@pytest.mark.parametrize(("register", "value"), [("goal_pwm", 200), ("pwm_limit", 200)])
def test_both_pwm_limits_bound_the_duty(bench: Any, register: str, value: int) -> None:
    bench.write("goal_pwm", 100)
    bench.write(register, value)
    if register == "pwm_limit":
        bench.write("goal_pwm", value)
    bench.arm()
    bench.write("goal_position", 0)
    assert min(bench.samples("present_pwm", 0.5)) == -value


def test_a_profile_keeps_to_its_speed_and_acceleration(bench: Any) -> None:
    bench.write("profile_velocity", 50)
    bench.write("profile_acceleration", 10)
    bench.arm()
    bench.write("goal_position", CENTRE + QUARTER_TURN)
    speeds = bench.samples("velocity_trajectory", 2.5)
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
    bench.arm()
    bench.write("goal_position", CENTRE + QUARTER_TURN)
    path = bench.samples("position_trajectory", 1.2)
    assert path[49] == pytest.approx(CENTRE + QUARTER_TURN // 2, abs=15)
    assert path[94] < CENTRE + QUARTER_TURN
    assert path[103] == CENTRE + QUARTER_TURN


def test_velocity_mode_reaches_its_goal_and_ramps_with_the_profile(bench: Any) -> None:
    bench.arm(OperatingMode.VELOCITY)
    bench.write("profile_acceleration", 5)
    bench.write("goal_velocity", -100)
    bench.run(0.5)
    asked = -0.5 * 5 * 214.577 / 60 / 0.229
    assert bench.read("velocity_trajectory") == pytest.approx(asked, abs=1)
    assert asked < bench.read("present_velocity") < asked / 2
    bench.run(2.0)
    assert bench.read("present_velocity") == pytest.approx(-100, abs=2)


def test_current_based_position_mode_pushes_no_harder_than_its_goal_current(bench: Any) -> None:
    bench.arm(OperatingMode.CURRENT_BASED_POSITION)
    bench.write("goal_current", 100)
    bench.write("goal_position", 0)
    bench.blocked = True
    bench.run(0.1)
    assert bench.read("present_current") == -100


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
