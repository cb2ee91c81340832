"""Which servos receive a packet: duplicate ids, secondary ids, baud rates, broken packets."""

import struct
from collections.abc import Callable
from typing import Any

import pytest

from drivers.dynamixel.tables.control_table import BAUD_RATES
from drivers.dynamixel.wire.codec import (
    ALERT,
    BROADCAST_ID,
    Instruction,
    PacketParser,
    StatusError,
    encode_instruction,
)
from drivers.servo.hardware_error import HardwareError
from sim_twin.servos import EmulatedServoSpec, ServoBank

THREE = ("XM430-W350", "XL430-W250", "XM540-W270")
READ_LED = struct.pack("<HH", 65, 1)
LED_ON = b"\x41\x00\x01"


@pytest.fixture
def trio(make_bench: Callable[..., Any]) -> Any:
    return make_bench(THREE)


def leds(trio: Any, ids: tuple[int, ...] = (1, 2, 3)) -> list[int]:
    return [trio.bank.register(servo_id, "led") for servo_id in ids]


def test_two_servos_with_one_id_both_obey_and_answer_garbage(trio: Any) -> None:
    assert trio.write("id", 1, 2) == 0
    trio.bank.receive(encode_instruction(1, Instruction.PING))
    answer = trio.bank.transmit()
    parser = PacketParser()
    parser.feed(answer)
    assert answer
    assert parser.packets() + parser.salvage() == []
    trio.bank.receive(encode_instruction(1, Instruction.WRITE, LED_ON))
    trio.bank.transmit()
    tables = trio.bank._firmware.registers.tables
    assert [table.get("led") for table in tables] == [1, 1, 0]
    assert trio.send(3, Instruction.PING)[0].servo_id == 3


def test_a_secondary_id_is_obeyed_and_not_answered(trio: Any) -> None:
    assert [trio.write("secondary_id", 20, servo_id) for servo_id in (1, 3)] == [0, 0]
    assert trio.send(20, Instruction.WRITE, LED_ON) == []
    assert leds(trio) == [1, 0, 1]
    assert trio.send(20, Instruction.READ, READ_LED) == []


def test_an_id_comes_before_a_secondary_id(trio: Any) -> None:
    trio.write("secondary_id", 2, 1)
    assert trio.send(2, Instruction.WRITE, LED_ON)[0].servo_id == 2
    assert leds(trio) == [0, 1, 0]


def test_a_servo_receives_at_its_own_rate_only(trio: Any) -> None:
    trio.bank.set_host_baud(57_600)
    assert len(trio.sync_read(65, 1, [1, 2, 3])) == 3
    assert trio.write("baud_rate", 3, 2) == 0
    assert [packet.servo_id for packet in trio.sync_read(65, 1, [1, 2, 3])] == [1, 3]
    trio.bank.set_host_baud(1_000_000)
    assert [packet.servo_id for packet in trio.send(BROADCAST_ID, Instruction.PING)] == [2]
    assert trio.write("baud_rate", 1, 2) == 0
    assert trio.send(BROADCAST_ID, Instruction.PING) == []
    trio.bank.set_host_baud(None)
    assert len(trio.send(BROADCAST_ID, Instruction.PING)) == 3


def test_a_factory_reset_gives_the_baud_rate_back(trio: Any) -> None:
    trio.write("baud_rate", 3, 1)
    trio.bank.set_host_baud(1_000_000)
    assert trio.send(1, Instruction.FACTORY_RESET, b"\x01")[0].error == 0
    trio.run(0.5)
    assert trio.send(1, Instruction.PING) == []
    trio.bank.set_host_baud(57_600)
    assert len(trio.send(1, Instruction.PING)) == 1


@pytest.mark.parametrize("value", sorted(BAUD_RATES))
def test_every_rate_of_the_table_is_understood(value: int) -> None:
    servo = EmulatedServoSpec(id=1, model_name="XM430-W350", eeprom={"baud_rate": value})
    bank = ServoBank([servo])
    bank.set_host_baud(BAUD_RATES[value])
    bank.receive(encode_instruction(1, Instruction.PING))
    assert bank.transmit()


def broken(packet: bytes) -> bytes:
    return packet[:-1] + bytes([packet[-1] ^ 0x10])


def test_a_broken_packet_is_answered_with_a_crc_error_by_the_servo_it_names(trio: Any) -> None:
    trio.bank.set_alert(2, HardwareError.ENCODER)
    for servo_id, expected in ((1, StatusError.CRC), (2, StatusError.CRC | ALERT)):
        trio.bank.receive(broken(encode_instruction(servo_id, Instruction.WRITE, LED_ON)))
        parser = PacketParser()
        parser.feed(trio.bank.transmit())
        assert [(one.servo_id, one.error) for one in parser.packets()] == [(servo_id, expected)]
    assert leds(trio) == [0, 0, 0]


@pytest.mark.parametrize("servo_id", [BROADCAST_ID, 9])
def test_a_broken_packet_to_all_or_to_an_unused_id_stays_unanswered(
    trio: Any, servo_id: int
) -> None:
    trio.bank.receive(broken(encode_instruction(servo_id, Instruction.PING)))
    assert trio.bank.transmit() == b""


def test_a_broken_packet_is_answered_as_far_as_the_status_return_level_goes(trio: Any) -> None:
    trio.write("status_return_level", 1)
    trio.bank.receive(broken(encode_instruction(1, Instruction.WRITE, LED_ON)))
    assert trio.bank.transmit() == b""
    trio.bank.receive(broken(encode_instruction(1, Instruction.READ, READ_LED)))
    assert trio.bank.transmit()


def test_a_broken_answer_of_another_servo_is_ignored(trio: Any) -> None:
    trio.bank.receive(broken(encode_instruction(1, Instruction.STATUS, b"\0")))
    assert trio.bank.transmit() == b""


@pytest.mark.parametrize(
    ("model", "firmware", "knows"),
    [
        ("XM430-W350", 44, False),
        ("XM430-W350", 45, True),
        ("XL330-M288", 45, False),
        ("XL330-M288", 46, True),
        ("2XL430-W250", 60, False),
    ],
)
def test_fast_reads_and_backup_need_a_model_and_firmware_that_know_them(
    model: str, firmware: int, knows: bool
) -> None:
    bank = ServoBank([EmulatedServoSpec(id=1, model_name=model, firmware_version=firmware)])

    def ask(servo_id: int, instruction: int, params: bytes) -> bytes:
        bank.receive(encode_instruction(servo_id, instruction, params))
        return bank.transmit()

    for instruction, request in (
        (Instruction.FAST_SYNC_READ, READ_LED + b"\1"),
        (Instruction.FAST_BULK_READ, b"\1" + READ_LED),
    ):
        assert bool(ask(BROADCAST_ID, instruction, request)) is knows
        refused = ask(1, instruction, request)[8] == StatusError.INSTRUCTION
        assert refused is not knows
    backup = ask(1, Instruction.CONTROL_TABLE_BACKUP, b"\x01CTRL")[8]
    assert backup == (StatusError.NONE if knows else StatusError.INSTRUCTION)


def test_a_fast_read_ends_at_a_servo_that_does_not_know_it() -> None:
    specs = [
        EmulatedServoSpec(id=1, model_name="XM430-W350"),
        EmulatedServoSpec(id=2, model_name="2XL430-W250"),
        EmulatedServoSpec(id=3, model_name="XM430-W350"),
    ]
    bank = ServoBank(specs)
    bank.receive(encode_instruction(BROADCAST_ID, Instruction.FAST_SYNC_READ, READ_LED + b"\1\2\3"))
    assert len(bank.transmit()) == 8 + 5
