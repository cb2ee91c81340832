"""Faults of adapter, speed or settings are found at connect and reported with their remedy."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from drivers.dynamixel.wire.codec import Instruction
from drivers.servo.errors import ServoSilent, SlowAdapter, WrongServo
from sim_twin.servos import EmulatedServoSpec

MakeBench = Callable[..., Any]
BAUDS = (57_600, 1_000_000, 2_000_000)


def test_a_servo_set_to_another_speed_is_found_and_the_remedy_named(
    make_paced: MakeBench,
) -> None:
    bench = make_paced(2, eeprom={"baud_rate": 1}, bauds=BAUDS)
    bench.bank.set_host_baud(1_000_000)
    with pytest.raises(ServoSilent) as caught:
        bench.bus.connect()
    text = str(caught.value)
    assert "2 of 2 servos do not answer at 1000000 baud" in text
    assert "servo 1 answers at 57600 baud: set it to 1000000 (`vla-deploy servo set-baud " in text


def test_the_speed_is_put_back_after_the_search(make_paced: MakeBench) -> None:
    bench = make_paced(2, eeprom={"baud_rate": 3}, bauds=BAUDS)
    bench.bank.set_host_baud(1_000_000)
    bench.bank.silence(2)
    with pytest.raises(ServoSilent, match="check motor power"):
        bench.bus.connect()
    bench.bank.silence(2, silent=False)
    bench.bus.connect()
    assert bench.bus.read_state().valid.all()


def test_a_slow_adapter_is_refused_with_what_to_do(make_paced: MakeBench) -> None:
    bench = make_paced(1)
    bench.line.adapter = "latency timer 16 ms; set it to 1"
    with pytest.raises(SlowAdapter, match="set it to 1"):
        bench.bus.connect()


@pytest.mark.parametrize("fast_sync", [False, True])
def test_an_echoing_adapter_is_detected_and_its_echo_removed(
    make_paced: MakeBench, fast_sync: bool
) -> None:
    bench = make_paced(16, fast_sync=fast_sync, health_every_cycles=5)
    bench.bank.set_echo(True)
    bench.bus.connect()
    bench.bus.enable_torque()
    for _ in range(20):
        state = bench.bus.read_state()
        bench.bus.write_goals(state.position_rad)
        assert state.valid.all()
    bench.bank.silence(7)
    for _ in range(20):
        bench.bus.read_state()
        bench.bus.write_goals(np.zeros(16))
        assert np.count_nonzero(bench.bus.state.valid) == 15
    counters = bench.bus.counters
    assert counters.crc_errors == counters.stuffed == counters.discarded_bytes == 0


def test_factory_settings_are_changed_once_and_reported(make_bench: MakeBench) -> None:
    bench = make_bench(2)
    setups = bench.bus.connect()
    assert [bench.bank.register(n, "return_delay_time") for n in (1, 2)] == [0, 0]
    assert bench.wire.count(Instruction.WRITE) == 2
    assert [setup.written for setup in setups] == [("return_delay_time 250 -> 0",)] * 2
    assert bench.bus.notices == (
        "servo 1 (joint_1, XM540-W270): set return_delay_time 250 -> 0",
        "servo 2 (joint_2, XM430-W350): set return_delay_time 250 -> 0",
    )
    bus = bench.new_bus()
    assert [setup.written for setup in bus.connect()] == [(), ()]
    assert bus.notices == ()
    assert bench.wire.count(Instruction.WRITE) == 2


def test_a_servo_that_would_power_its_motor_by_itself_is_refused(make_bench: MakeBench) -> None:
    servos = [EmulatedServoSpec(id=1, model_name="XM540-W270", eeprom={"startup_configuration": 1})]
    bench = make_bench(1, servos=servos)
    with pytest.raises(WrongServo, match="startup_configuration 0, got 1"):
        bench.bus.connect()
    assert bench.wire.count(Instruction.WRITE) == 0
