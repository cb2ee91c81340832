"""Overload, current, temperature and voltage, and how they end."""

from collections.abc import Callable
from typing import Any

import pytest

from drivers.feetech.codec import FeetechInstruction
from drivers.servo.hardware_error import HardwareError
from sim_twin.servos.feetech import FeetechOptions

VOLTAGE, HEAT, CURRENT, LOAD = 0x01, 0x04, 0x08, 0x20


def strain(bench: Any, seconds: float) -> None:
    """Push against a stop with full duty."""
    bench.blocked = True
    bench.write("torque_enable", 1)
    bench.write("goal_position", 3000)
    bench.run(seconds)


@pytest.mark.parametrize("clears", [False, True])
def test_an_overload_leaves_a_fifth_of_the_torque_until_power_is_lost(
    make_bench: Callable[..., Any], clears: bool
) -> None:
    bench = make_bench(options=FeetechOptions(torque_off_clears_overload=clears))
    strain(bench, 1.9)
    assert bench.error() == 0
    assert bench.read("present_load") == 1000
    bench.run(0.3)
    assert bench.error() == LOAD
    assert bench.read("hardware_error_status") == LOAD
    assert bench.read("present_load") == 200
    assert bench.read("torque_enable") == 1
    bench.blocked = False
    bench.run(1.0)
    assert bench.error() == LOAD
    bench.write("torque_enable", 0)
    assert bench.write("torque_enable", 1) == (0 if clears else LOAD)
    bench.reboot()
    assert bench.error() == 0


@pytest.mark.parametrize(
    ("name", "value"), [("overload_torque", 110), ("protection_time", 254), ("torque_limit", 700)]
)
def test_registers_move_the_overload(bench: Any, name: str, value: int) -> None:
    bench.write(name, value)
    strain(bench, 2.3)
    assert bench.error() == 0


def test_without_its_bit_in_shutdown_an_overload_is_only_reported(bench: Any) -> None:
    bench.write("shutdown", 0)
    strain(bench, 2.3)
    assert bench.error() == LOAD
    assert bench.read("present_load") == 1000


def test_an_over_current_switches_off(bench: Any) -> None:
    bench.write("protection_current", 250)
    bench.write("overcurrent_time", 50)
    strain(bench, 0.4)
    assert abs(bench.read("present_current") - 2.7 / 6.5e-3) < 15
    bench.run(0.2)
    assert bench.error() == CURRENT
    assert bench.read("torque_enable") == 0
    bench.write("torque_enable", 1)
    assert bench.read("torque_enable") == 0


def test_a_hot_servo_is_off_until_it_has_cooled(bench: Any) -> None:
    bench.write("torque_enable", 1)
    bench.bank.heat(1, 70.0)
    bench.run(0.03)
    assert (bench.error(), bench.read("torque_enable")) == (HEAT, 0)
    assert bench.read("present_temperature") == 70
    bench.bank.heat(1, 60.0)
    bench.run(0.03)
    assert bench.error() == 0
    bench.write("torque_enable", 1)
    assert bench.read("torque_enable") == 1


@pytest.mark.parametrize("volts", [3.8, 14.2])
@pytest.mark.parametrize(("shutdown", "torque"), [(44, 1), (45, 0)])
def test_a_wrong_voltage_is_reported_while_it_lasts(
    bench: Any, volts: float, shutdown: int, torque: int
) -> None:
    bench.write("shutdown", shutdown)
    bench.write("torque_enable", 1)
    bench.supply_v = volts
    bench.run(0.03)
    assert (bench.error(), bench.read("torque_enable")) == (VOLTAGE, torque)
    assert bench.read("present_voltage") == round(volts * 10)
    bench.supply_v = 12.0
    bench.run(0.03)
    assert bench.error() == 0


def test_below_3_5_volts_servos_are_off_and_boot_when_it_comes_back(bench: Any) -> None:
    bench.write("torque_enable", 1)
    bench.write("position_p_gain", 16)
    bench.supply_v = 3.3
    bench.run(0.1)
    assert bench.send(1, FeetechInstruction.PING) == []
    assert not bench.duty.any()
    bench.supply_v = 12.0
    bench.run(0.5)
    assert bench.send(1, FeetechInstruction.PING) == []
    bench.run(0.5)
    assert bench.read("torque_enable") == 0
    assert bench.read("position_p_gain") == 32


def test_alerts_are_given_in_the_words_of_all_families(bench: Any) -> None:
    bench.bank.set_alert(1, HardwareError.ENCODER | HardwareError.OVERHEATING)
    assert bench.error() == 0x02 | 0x04
    with pytest.raises(ValueError, match="no ELECTRICAL_SHOCK"):
        bench.bank.set_alert(1, HardwareError.ELECTRICAL_SHOCK)


def test_a_servo_can_count_as_overloaded_whatever_it_carries(bench: Any) -> None:
    bench.bank.overload(1)
    bench.run(0.03)
    bench.bank.overload(1, False)
    bench.run(0.03)
    assert bench.error() == LOAD


def test_the_supply_gives_what_the_motors_take(bench: Any) -> None:
    strain(bench, 0.5)
    assert bench.bank.supply_w == pytest.approx(12.0 * 2.7, rel=0.1)
    assert bench.read("present_voltage") < 120
