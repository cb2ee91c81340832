"""Single servos at the bench: found, told apart, and changed so that it outlives a power cut."""

from collections.abc import Callable
from typing import Any

import pytest

from drivers.clock import NS_PER_S
from drivers.dynamixel.tools.bench import DynamixelBench
from drivers.errors import LinkLost
from drivers.servo.errors import ServoSilent, WrongServo
from drivers.servo.hardware_error import HardwareError
from drivers.servo.tools.bench import Keep
from drivers.servo.tools.scan import scan_speed
from sim_twin.ports.lines import MemoryLine
from sim_twin.servos import EmulatedServoSpec
from sim_twin.servos.server import FreeServos

MakeBench = Callable[..., Any]


def test_all_servos_are_found_at_once_with_model_and_firmware(make_bench: MakeBench) -> None:
    bench = make_bench(3)
    report = scan_speed(bench.open())
    found = [(one.servo_id, one.model_name, one.firmware) for one in report.servos]
    assert found == [(n, "STS3215", "3.10") for n in (1, 2, 3)]
    assert (report.clashes, report.noise_bytes) == ((), 0)


def test_scs_servos_say_their_number_the_other_way_round(make_bench: MakeBench) -> None:
    bench = make_bench(1, model="SCS0009", supply_v=6.0)
    assert bench.open().ping(1).model_name == "SCS0009"


def test_two_servos_of_one_id_are_no_servo(make_bench: MakeBench) -> None:
    bench = make_bench(3)
    bench.bank.set_clash(2)
    report = scan_speed(bench.open())
    assert [one.servo_id for one in report.servos] == [1, 3]
    assert report.clashes == (2,)


def test_an_empty_bus_is_empty(make_bench: MakeBench) -> None:
    bench = make_bench(1)
    bench.bank.silence(1)
    report = scan_speed(bench.open())
    assert (report.servos, report.other_family_ids, report.noise_bytes) == ((), (), 0)


def test_each_family_knows_that_another_one_answers(make_bench: MakeBench) -> None:
    bench = make_bench(2)
    report = scan_speed(DynamixelBench(bench.line, bench, 1_000_000))
    assert (report.servos, report.other_family_ids) == ((), (1, 2))

    others = FreeServos([EmulatedServoSpec(id=7, model_name="XL430-W250")])
    others.advance_to(10 * NS_PER_S)
    link = bench.open()
    link.link._transport = MemoryLine(others.bank, bench)
    assert link.other_family_ids() == (7,)


def test_an_id_is_kept_over_a_restart(make_bench: MakeBench) -> None:
    bench = make_bench(2)
    link = bench.open()
    link.set_id(link.servo(2), 9)
    moved = link.servo(9)
    assert str(moved) == "servo 9 (bench, STS3215)"
    link.reboot(moved)
    assert link.ping(9).servo_id == 9
    assert bench.bank.register(9, "lock") == 1
    with pytest.raises(ServoSilent, match="check power, cable, id and speed"):
        link.ping(2)


def test_a_speed_is_kept_over_a_restart(make_bench: MakeBench) -> None:
    bench = make_bench(1)
    link = bench.open()
    servo = link.servo(1)
    assert set(link.bauds(servo)) == {1_000_000, 500_000, 250_000, 128_000, 115_200}
    link.set_baud(servo, 500_000)
    assert link.present_baud(servo) == 500_000
    link.reboot(servo)
    assert link.present_baud(servo) == 500_000


def test_a_factory_reset_keeps_the_id(make_bench: MakeBench) -> None:
    bench = make_bench(2, eeprom={2: {"temperature_limit": 50}})
    link = bench.open()
    assert link.keeps == (Keep.ID,)
    link.factory_reset(link.servo(2), Keep.ID)
    link.await_boot(2)
    rows = {one.name: one for one in link.registers(link.servo(2))}
    assert rows["temperature_limit"].value == rows["temperature_limit"].initial == 70


def test_readings_are_in_units_and_errors_in_words(make_bench: MakeBench) -> None:
    bench = make_bench(2)
    link = bench.open()
    servos = [link.servo(1), link.servo(2)]
    bench.rotors.position_rad[:] = [0.5, -0.25]
    bench.run(0.004)
    bench.bank.set_alert(2, HardwareError.OVERHEATING)
    first, second = link.read_servos(servos, {1: "shoulder_pan"})
    assert (first.joint, first.model, first.errors) == ("shoulder_pan", "STS3215", "none")
    assert first.position_rad == pytest.approx(0.5, abs=0.002)
    assert second.errors == "overheating"
    assert (second.voltage_v, second.temperature_c) == (pytest.approx(12.0), 25)
    assert link.hardware_error(servos[1]) == HardwareError.OVERHEATING


def test_positions_are_what_the_servos_show(make_bench: MakeBench) -> None:
    bench = make_bench(2, eeprom={2: {"homing_offset": 700}})
    link = bench.open()
    assert link.positions([link.servo(1), link.servo(2)]) == {1: 2048, 2: 1348}


def test_a_model_that_is_not_known_is_refused_with_those_that_are(make_bench: MakeBench) -> None:
    bench = make_bench(1)
    bench.edit = lambda reply: reply.replace(b"\x09\x03", b"\x10\x27").replace(
        reply[-1:], bytes([(reply[-1] - 0x2B) & 0xFF])
    )
    with pytest.raises(WrongServo, match=r"unknown model 10000; .*STS3250"):
        bench.open().servo(1)


def test_a_lost_adapter_is_told(make_bench: MakeBench) -> None:
    bench = make_bench(1)
    link = bench.open()

    def gone(*_: object) -> bytes:
        raise LinkLost("unplugged")

    bench.line.write = gone
    with pytest.raises(LinkLost, match="unplugged"):
        link.ping(1)
