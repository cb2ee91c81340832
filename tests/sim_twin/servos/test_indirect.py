"""Indirect addresses bring scattered registers into one block, for reads and writes."""

import struct
from collections.abc import Callable, Sequence
from typing import Any

import pytest

from drivers.dynamixel.wire.codec import (
    BROADCAST_ID,
    Instruction,
    StatusError,
    decode_fast_entries,
    encode_instruction,
)
from sim_twin.servos import EmulatedServoSpec, ServoBank

ADDRESSES, DATA, SLOTS = 168, 224, 28
POSITION, HARDWARE_ERROR, VOLTAGE_TEMPERATURE = range(132, 136), (70,), (144, 145, 146)
STATE = (*POSITION, *HARDWARE_ERROR, *VOLTAGE_TEMPERATURE)


def map_slots(bench: Any, targets: Sequence[int], servo_id: int = 1, first: int = 0) -> int:
    data = b"".join(struct.pack("<H", target) for target in targets)
    error: int = bench.write_bytes(servo_id, ADDRESSES + 2 * first, data)
    return error


def read(bench: Any, address: int, length: int, servo_id: int = 1) -> bytes:
    params = struct.pack("<HH", address, length)
    data: bytes = bench.send(servo_id, Instruction.READ, params)[0].params
    return data


def test_slots_point_at_themselves_at_first_and_are_plain_memory(bench: Any) -> None:
    expected = struct.pack(f"<{SLOTS}H", *range(DATA, DATA + SLOTS))
    assert read(bench, ADDRESSES, 2 * SLOTS) == expected
    assert read(bench, DATA, SLOTS) == bytes(SLOTS)
    assert bench.write_bytes(1, DATA + 3, b"\x07\x08") == 0
    assert read(bench, DATA, 6) == b"\0\0\0\x07\x08\0"


def test_a_block_of_slots_shows_what_is_sensed_at_the_time_of_reading(bench: Any) -> None:
    assert map_slots(bench, STATE) == 0
    bench.turn_to(1.0)
    bench.bank.set_alert(1, 8)
    pulses, error, volts, celsius = struct.unpack("<iBHB", read(bench, DATA, len(STATE)))
    assert pulses == bench.read("present_position") > 2600
    assert (error, volts, celsius) == (8, 120, bench.read("present_temperature"))


def test_both_banks_and_a_read_across_the_edge_of_a_bank_work(bench: Any) -> None:
    assert bench.write_bytes(1, 578, struct.pack("<2H", 0, 1)) == StatusError.DATA_RANGE
    assert bench.write_bytes(1, 578, struct.pack("<2H", 144, 145)) == 0
    assert read(bench, 634, 2) == struct.pack("<H", 120)
    assert map_slots(bench, (146,), first=SLOTS - 1) == 0
    temperature = bench.read("present_temperature")
    assert read(bench, DATA + SLOTS - 1, 3) == bytes([temperature, 0, 0])


def test_a_write_through_slots_reaches_the_registers_as_a_whole(bench: Any) -> None:
    assert map_slots(bench, (*range(116, 120), 65, *range(112, 116))) == 0
    data = struct.pack("<iBI", 3000, 1, 150)
    assert bench.write_bytes(1, DATA, data) == 0
    assert [bench.read(name) for name in ("goal_position", "led", "profile_velocity")] == [
        3000,
        1,
        150,
    ]
    assert read(bench, DATA, len(data)) == data
    assert bench.write_bytes(1, DATA, struct.pack("<iB", 9000, 0)) == StatusError.DATA_LIMIT
    assert (bench.read("goal_position"), bench.read("led")) == (3000, 1)


def test_part_of_a_register_and_a_read_only_one_are_refused_behind_slots_too(bench: Any) -> None:
    map_slots(bench, (116, 117, 146))
    assert bench.write_bytes(1, DATA, b"\0\0") == StatusError.DATA_LENGTH
    assert bench.write_bytes(1, DATA + 2, b"\0") == StatusError.ACCESS


@pytest.mark.parametrize("target", [0, 63, 662, 65_535])
def test_an_address_without_ram_behind_it_is_refused(bench: Any, target: int) -> None:
    assert map_slots(bench, (target,)) == StatusError.DATA_RANGE
    assert read(bench, ADDRESSES, 2) == struct.pack("<H", DATA)


def test_a_reboot_forgets_the_map(bench: Any) -> None:
    map_slots(bench, STATE)
    bench.send(1, Instruction.REBOOT)
    bench.run(0.5)
    assert read(bench, ADDRESSES, 2) == struct.pack("<H", DATA)
    assert read(bench, DATA, 8) == bytes(8)


def test_sync_reads_of_the_block_see_each_servos_own_map(make_bench: Callable[..., Any]) -> None:
    bench = make_bench(("XM430-W350", "XL430-W250"))
    bench.run(0.01)
    for servo_id, targets in ((1, STATE), (2, STATE[::-1])):
        assert map_slots(bench, targets, servo_id) == 0
        bench.bank.set_alert(servo_id, 8)
    bench.run(0.01)
    params = struct.pack("<HH", DATA, len(STATE)) + b"\1\2"
    for angle_rad in (0.5, 1.0):
        bench.turn_to(angle_rad)
        one, two = (packet.params for packet in bench.sync_read(DATA, len(STATE), [1, 2]))
        bench.bank.receive(encode_instruction(BROADCAST_ID, Instruction.FAST_SYNC_READ, params))
        entries = decode_fast_entries(bench.bank.transmit(), len(STATE))
        assert [data for _, _, data in entries] == [one, two]
        assert one[:4] == two[::-1][:4] == struct.pack("<i", bench.read("present_position"))
        assert one[4] == two[3] == 8


def test_a_sync_write_of_the_block_reaches_every_servo(make_bench: Callable[..., Any]) -> None:
    bench = make_bench(("XM430-W350", "XL430-W250"))
    for servo_id in (1, 2):
        map_slots(bench, (*range(116, 120), 65), servo_id)
    bench.sync_write(DATA, 5, {n: struct.pack("<iB", 1000 * n, 1) for n in (1, 2)})
    assert [bench.read("goal_position", n) for n in (1, 2)] == [1000, 2000]
    assert [bench.read("led", n) for n in (1, 2)] == [1, 1]


@pytest.mark.parametrize(("firmware", "data", "slots"), [(52, 208, 20), (53, 224, 28)])
def test_an_x330_has_its_slots_where_its_firmware_puts_them(
    firmware: int, data: int, slots: int
) -> None:
    bank = ServoBank([EmulatedServoSpec(id=1, model_name="XL330-M288", firmware_version=firmware)])

    def ask(instruction: int, params: bytes) -> bytes:
        bank.receive(encode_instruction(1, instruction, params))
        return bank.transmit()

    assert ask(Instruction.READ, struct.pack("<HH", data, slots))[8] == 0
    assert ask(Instruction.READ, struct.pack("<HH", data, slots + 1))[8] == StatusError.ACCESS
    ask(Instruction.WRITE, struct.pack("<HH", ADDRESSES, 65))
    ask(Instruction.WRITE, struct.pack("<HB", data, 1))
    assert bank.register(1, "led") == 1
