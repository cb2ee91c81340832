from collections.abc import Callable
from typing import Any

from drivers.dynamixel.wire.codec import ALERT, Instruction, StatusError
from drivers.servo.hardware_error import HardwareError


def stall(bench: Any, seconds: float) -> None:
    bench.arm()
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
    bench.arm()
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
    bench.arm()
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
    bench.arm()
    bench.bank.heat(1, 85.0)
    bench.run(0.05)
    assert bench.read("torque_enable") == 1
    assert bench.write("led", 1) == ALERT


def test_an_overload_from_outside_trips_and_holds_until_it_ends(bench: Any) -> None:
    bench.arm()
    bench.bank.overload(1)
    bench.run(0.05)
    assert bench.read("hardware_error_status") == HardwareError.OVERLOAD
    assert bench.read("torque_enable") == 0
    bench.bank.overload(1, on=False)
    bench.send(1, Instruction.REBOOT)
    bench.run(0.5)
    assert bench.read("hardware_error_status") == 0


def test_a_fault_from_outside_is_treated_as_one_from_inside(bench: Any) -> None:
    bench.arm()
    bench.bank.set_alert(1, HardwareError.ELECTRICAL_SHOCK)
    assert bench.read("torque_enable") == 0
    bench.run(0.01)
    assert bench.duty[0] == 0.0
