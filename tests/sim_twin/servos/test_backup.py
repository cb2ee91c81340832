"""The control table backup keeps what the manual lists, and gives it back when asked."""

import struct
from typing import Any

import pytest

from drivers.dynamixel.wire.codec import BROADCAST_ID, Instruction, StatusError, encode_instruction

BACK_UP, RESTORE = b"\x01CTRL", b"\x02CTRL"


def order(bench: Any, params: bytes) -> int:
    error: int = bench.send(1, Instruction.CONTROL_TABLE_BACKUP, params)[0].error
    return error


def test_the_packet_is_the_one_of_the_manual() -> None:
    packet = encode_instruction(1, Instruction.CONTROL_TABLE_BACKUP, BACK_UP)
    assert packet == bytes.fromhex("fffffd0001080020014354524c16f5")


def test_a_restore_gives_the_eeprom_back_and_reboots(bench: Any) -> None:
    bench.write("return_delay_time", 7)
    assert order(bench, BACK_UP) == 0
    assert bench.read("backup_ready") == 1
    bench.write("return_delay_time", 9)
    bench.write("led", 1)
    assert order(bench, RESTORE) == 0
    assert bench.send(1, Instruction.PING) == []
    bench.run(0.5)
    assert [bench.read(n) for n in ("return_delay_time", "led", "backup_ready")] == [7, 0, 1]


@pytest.mark.parametrize(("configuration", "gain", "target"), [(0, 800, 224), (2, 321, 132)])
def test_the_startup_configuration_gives_gains_and_indirect_addresses_back(
    bench: Any, configuration: int, gain: int, target: int
) -> None:
    bench.write("startup_configuration", configuration)
    bench.write("position_p_gain", 321)
    bench.write_bytes(1, 168, struct.pack("<H", 132))
    bench.write("led", 1)
    assert order(bench, BACK_UP) == 0
    bench.send(1, Instruction.REBOOT)
    bench.run(0.5)
    assert (bench.read("position_p_gain"), bench.read("led")) == (gain, 0)
    mapped = bench.send(1, Instruction.READ, struct.pack("<HH", 168, 2))[0].params
    assert mapped == struct.pack("<H", target)


def test_a_restored_id_is_the_one_that_answers(bench: Any) -> None:
    order(bench, BACK_UP)
    assert bench.write_bytes(1, 7, b"\x05") == 0
    assert bench.send(5, Instruction.CONTROL_TABLE_BACKUP, RESTORE)[0].error == 0
    bench.run(0.5)
    assert [packet.servo_id for packet in bench.send(BROADCAST_ID, Instruction.PING)] == [1]


def test_a_backup_is_refused_with_torque_on_and_with_other_params(bench: Any) -> None:
    assert order(bench, RESTORE) == StatusError.RESULT_FAIL
    assert order(bench, b"\x03CTRL") == StatusError.DATA_RANGE
    assert order(bench, b"") == StatusError.DATA_RANGE
    bench.write("torque_enable", 1)
    assert order(bench, BACK_UP) == StatusError.RESULT_FAIL
    assert bench.read("backup_ready") == 0
