"""Connecting proves that the servos are those of the robot file, or says what is wrong."""

from collections.abc import Callable
from typing import Any

import pytest

from drivers.dynamixel import DynamixelBus, OperatingMode, ServoSpec, WatchdogState
from drivers.errors import DriverError, NoReply, WrongDevice
from drivers.servo.errors import ServoSilent, WrongServo
from sim_twin.servos import EmulatedServoSpec

MakeBench = Callable[..., Any]


def test_the_operating_mode_asked_for_is_set(make_bench: MakeBench) -> None:
    spec = ServoSpec(
        id=1,
        model_name="XM430-W350",
        joint="turntable",
        operating_mode=OperatingMode.EXTENDED_POSITION,
    )
    bench = make_bench(specs=[spec])
    (setup,) = bench.bus.connect()
    assert bench.bank.register(1, "operating_mode") == OperatingMode.EXTENDED_POSITION
    assert setup.maximum_pulse == 1_048_575


def test_all_silent_servos_are_named_in_one_error(make_bench: MakeBench) -> None:
    bench = make_bench()
    bench.bank.silence(2)
    bench.bank.silence(4)
    with pytest.raises(ServoSilent) as caught:
        bench.bus.connect()
    assert isinstance(caught.value, NoReply)
    text = str(caught.value)
    assert "2 of 4" in text
    assert "servo 2 (joint_2, XM430-W350)" in text
    assert "servo 4 (joint_4, XC430-W150)" in text
    assert "check motor power" in text


def test_a_wrong_model_is_named_with_expected_and_got(make_bench: MakeBench) -> None:
    servos = [EmulatedServoSpec(id=1, model_name="XL430-W250")]
    bench = make_bench(1, servos=servos)
    with pytest.raises(WrongServo, match=r"expected model 1120, got 1060 \(XL430-W250\)") as caught:
        bench.bus.connect()
    assert isinstance(caught.value, WrongDevice)


def test_old_firmware_is_refused_with_what_to_do(make_bench: MakeBench) -> None:
    servos = [EmulatedServoSpec(id=1, model_name="XM540-W270", firmware_version=44)]
    with pytest.raises(WrongServo, match=r"needs firmware 45, got 44.*set fast_sync = false"):
        make_bench(1, servos=servos).bus.connect()
    make_bench(1, servos=servos, fast_sync=False).bus.connect()


@pytest.mark.parametrize(("name", "value"), [("homing_offset", -100), ("drive_mode", 1)])
def test_an_offset_or_direction_kept_in_the_servo_is_refused(
    make_bench: MakeBench, name: str, value: int
) -> None:
    servos = [EmulatedServoSpec(id=1, model_name="XM540-W270", eeprom={name: value})]
    with pytest.raises(WrongServo, match=f"expected {name} 0, got {value}"):
        make_bench(1, servos=servos).bus.connect()


def test_a_setting_that_torque_locks_is_reported_and_left(make_bench: MakeBench) -> None:
    bench = make_bench(1)
    bench.bus.connect()
    bench.bus.enable_torque()
    spec = ServoSpec(
        id=1, model_name="XM540-W270", joint="joint_1", operating_mode=OperatingMode.VELOCITY
    )
    bus = DynamixelBus(bench.line, bench, [spec], baud=1_000_000)
    with pytest.raises(WrongServo, match="expected operating_mode 1, got 3, and torque is on"):
        bus.connect()
    assert bench.bank.register(1, "torque_enable") == 1


def test_connecting_again_leaves_torque_on_and_finds_a_tripped_watchdog(bench: Any) -> None:
    bench.bus.enable_torque()
    bench.run(0.3)
    bus = bench.new_bus()
    bus.connect()
    assert bus.state.torque_on.all()
    assert bus.watchdog is WatchdogState.TRIPPED
    assert len(bus.watchdog_tripped) == 4


def test_a_servo_that_answers_pings_only_is_made_to_answer_all(bench: Any) -> None:
    bench.bus.write_register(1, "status_return_level", 1)
    bench.bus.connect()
    assert bench.bank.register(1, "status_return_level") == 2


def test_goals_before_connect_are_refused(make_bench: MakeBench) -> None:
    bench = make_bench(1)
    with pytest.raises(DriverError, match="call connect"):
        bench.bus.write_goals(bench.bus.state.position_rad)


def test_a_servo_declared_badly_or_twice_is_refused(make_bench: MakeBench) -> None:
    with pytest.raises(ValueError, match=r"id must be 0..252, got 253; model must be one of"):
        ServoSpec(id=253, model_name="XM999", joint="a")
    with pytest.raises(ValueError, match="no operating mode CURRENT"):
        ServoSpec(id=1, model_name="XL430-W250", joint="a", operating_mode=OperatingMode.CURRENT)
    bench = make_bench(1)
    line, specs = bench.line, bench.specs
    with pytest.raises(ValueError, match="its own id, got twice: 1"):
        DynamixelBus(line, bench, specs + specs, baud=1_000_000)
    with pytest.raises(ValueError, match="at least one servo"):
        DynamixelBus(line, bench, [], baud=1_000_000)
    with pytest.raises(ValueError, match=r"bus watchdog must be 0.02..2.54 s, got 5"):
        DynamixelBus(line, bench, specs, baud=1_000_000, watchdog_s=5)
