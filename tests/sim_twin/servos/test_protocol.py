import struct
from collections.abc import Callable
from typing import Any

import pytest

from drivers.dynamixel.wire.codec import (
    ALERT,
    BROADCAST_ID,
    Instruction,
    PacketParser,
    StatusError,
    decode_fast_entries,
    encode_instruction,
)
from sim_twin.servos import EmulatedServoSpec, FirmwareOptions, ServoBank

POSITION = struct.pack("<HH", 132, 4)
CENTRE = struct.pack("<i", 2048)
THREE = ("XM430-W350", "XL430-W250", "XM540-W270")


@pytest.fixture
def trio(make_bench: Callable[..., Any]) -> Any:
    return make_bench(THREE)


def ids(packets: Any) -> list[int]:
    return [packet.servo_id for packet in packets]


def test_ping_returns_model_and_firmware(trio: Any) -> None:
    assert trio.send(2, Instruction.PING)[0].params == struct.pack("<HB", 1060, 48)
    assert trio.send(7, Instruction.PING) == []


def test_a_broadcast_ping_is_answered_in_the_order_of_ids() -> None:
    specs = [EmulatedServoSpec(id=n, model_name="XM430-W350") for n in (9, 3, 200)]
    bank = ServoBank(specs)
    bank.receive(encode_instruction(BROADCAST_ID, Instruction.PING))
    parser = PacketParser()
    parser.feed(bank.transmit())
    assert ids(parser.packets()) == [3, 9, 200]


def test_other_broadcasts_act_on_all_and_get_no_answer(trio: Any) -> None:
    assert trio.send(BROADCAST_ID, Instruction.WRITE, b"\x41\x00\x01") == []
    assert [trio.read("led", n) for n in (1, 2, 3)] == [1, 1, 1]
    assert trio.send(BROADCAST_ID, Instruction.REBOOT) == []
    assert trio.send(1, Instruction.PING) == []


def test_sync_read_is_answered_in_the_order_asked_for(trio: Any) -> None:
    packets = trio.sync_read(132, 4, [3, 1, 2])
    assert ids(packets) == [3, 1, 2]
    assert all(packet.params == CENTRE for packet in packets)


def test_the_others_answer_a_sync_read_when_one_is_silent(trio: Any) -> None:
    trio.bank.silence(2)
    assert ids(trio.sync_read(132, 4, [1, 2, 3])) == [1, 3]
    trio.bank.silence(2, silent=False)
    assert ids(trio.sync_read(132, 4, [1, 2, 3])) == [1, 2, 3]


def test_a_silent_servo_can_end_the_chain_of_a_sync_read(make_bench: Callable[..., Any]) -> None:
    bench = make_bench(THREE, options=FirmwareOptions(sync_read_stops_at_missing=True))
    bench.bank.silence(2)
    assert ids(bench.sync_read(132, 4, [1, 2, 3])) == [1]


def fast_read(bench: Any, asked: list[int]) -> bytes:
    request = encode_instruction(BROADCAST_ID, Instruction.FAST_SYNC_READ, POSITION + bytes(asked))
    bench.bank.receive(request)
    reply: bytes = bench.bank.transmit()
    return reply


def test_fast_sync_read_is_one_packet_with_a_crc_after_every_servo(trio: Any) -> None:
    trio.bank.set_alert(2, 1)
    reply = fast_read(trio, [1, 2, 3])
    assert len(reply) == 8 + 3 * 8
    assert struct.unpack_from("<H", reply, 5)[0] == len(reply) - 7
    assert decode_fast_entries(reply, 4) == [(0, 1, CENTRE), (ALERT, 2, CENTRE), (0, 3, CENTRE)]


def test_fast_sync_read_ends_where_a_servo_is_missing(trio: Any) -> None:
    trio.bank.silence(2)
    reply = fast_read(trio, [1, 2, 3])
    assert len(reply) == 8 + 8
    assert struct.unpack_from("<H", reply, 5)[0] == 1 + 3 * 8
    assert decode_fast_entries(reply, 4) == [(0, 1, CENTRE)]
    trio.bank.silence(1)
    assert fast_read(trio, [1, 2, 3]) == b""


def test_a_fast_sync_read_longer_than_any_packet_stays_unanswered(trio: Any) -> None:
    params = struct.pack("<HH", 0, 65_535) + b"\1\2\3"
    assert trio.send(BROADCAST_ID, Instruction.FAST_SYNC_READ, params) == []
    assert len(trio.send(1, Instruction.PING)) == 1


@pytest.mark.parametrize(
    "instruction", [Instruction.FAST_SYNC_READ, Instruction.FAST_BULK_READ, Instruction.SYNC_READ]
)
def test_a_group_read_without_ids_stays_unanswered(trio: Any, instruction: Instruction) -> None:
    assert trio.send(BROADCAST_ID, instruction) == []
    assert trio.send(BROADCAST_ID, instruction, POSITION) == []


def test_a_fast_sync_read_past_the_table_returns_the_error_of_every_servo(trio: Any) -> None:
    params = struct.pack("<HH", 662, 2) + b"\1\2"
    trio.bank.receive(encode_instruction(BROADCAST_ID, Instruction.FAST_SYNC_READ, params))
    entries = decode_fast_entries(trio.bank.transmit(), 2)
    assert entries == [(StatusError.ACCESS, n, b"\0\0") for n in (1, 2)]


def test_a_bulk_write_that_ends_early_leaves_its_last_servo_alone(trio: Any) -> None:
    params = struct.pack("<BHHB", 1, 65, 1, 1) + struct.pack("<BHHB", 2, 65, 2, 1)
    trio.send(BROADCAST_ID, Instruction.BULK_WRITE, params)
    assert (trio.read("led", 1), trio.read("led", 2)) == (1, 0)


def test_a_corrupted_reply_fails_its_crc_once(trio: Any) -> None:
    trio.bank.corrupt_next(2)
    request = encode_instruction(BROADCAST_ID, Instruction.SYNC_READ, POSITION + b"\1\2\3")
    trio.bank.receive(request)
    parser = PacketParser()
    parser.feed(trio.bank.transmit())
    assert ids(parser.packets()) == [1, 3]
    assert parser.crc_errors == 1
    assert ids(trio.sync_read(132, 4, [1, 2, 3])) == [1, 2, 3]
    trio.bank.corrupt_next(2)
    assert decode_fast_entries(fast_read(trio, [1, 2, 3]), 4) == [(0, 1, CENTRE)]
    assert len(decode_fast_entries(fast_read(trio, [1, 2, 3]), 4)) == 3


def test_bulk_read_takes_a_range_per_servo(trio: Any) -> None:
    params = struct.pack("<BHHBHH", 3, 0, 2, 1, 132, 4)
    packets = trio.send(BROADCAST_ID, Instruction.BULK_READ, params)
    assert [(p.servo_id, p.params) for p in packets] == [(3, struct.pack("<H", 1120)), (1, CENTRE)]


def test_bulk_write_takes_a_range_per_servo(trio: Any) -> None:
    params = struct.pack("<BHHB", 1, 65, 1, 1) + struct.pack("<BHHI", 3, 112, 4, 77)
    assert trio.send(BROADCAST_ID, Instruction.BULK_WRITE, params) == []
    assert (trio.read("led", 1), trio.read("profile_velocity", 3)) == (1, 77)


def test_a_sync_write_reaches_each_servo_with_its_own_value(trio: Any) -> None:
    trio.sync_write(112, 4, {n: struct.pack("<I", 10 * n) for n in (1, 2, 3)})
    assert [trio.read("profile_velocity", n) for n in (1, 2, 3)] == [10, 20, 30]


def test_one_refused_value_of_a_sync_write_leaves_the_others(trio: Any) -> None:
    trio.sync_write(116, 4, {1: struct.pack("<i", 9_000), 2: struct.pack("<i", 1_000)})
    assert trio.read("goal_position", 1) == 2048
    assert trio.read("goal_position", 2) == 1_000


def test_a_registered_write_waits_for_the_action(trio: Any) -> None:
    assert trio.send(1, Instruction.REG_WRITE, b"\x41\x00\x01")[0].error == 0
    assert (trio.read("led"), trio.read("registered_instruction")) == (0, 1)
    assert trio.send(BROADCAST_ID, Instruction.ACTION) == []
    assert (trio.read("led"), trio.read("registered_instruction")) == (1, 0)
    assert trio.send(1, Instruction.ACTION)[0].error == StatusError.INSTRUCTION
    assert trio.send(1, Instruction.REG_WRITE, b"\x41\x00\x09")[0].error == StatusError.DATA_RANGE


def test_a_reboot_forgets_a_registered_write(bench: Any) -> None:
    bench.send(1, Instruction.REG_WRITE, b"\x41\x00\x01")
    bench.send(1, Instruction.REBOOT)
    bench.run(0.3)
    assert bench.send(1, Instruction.ACTION)[0].error == StatusError.INSTRUCTION


@pytest.mark.parametrize(("level", "answered"), [(0, "p"), (1, "pr"), (2, "prw")])
def test_the_status_return_level_says_what_is_answered(
    bench: Any, level: int, answered: str
) -> None:
    bench.write("status_return_level", level)
    replies = {
        "p": bench.send(1, Instruction.PING),
        "r": bench.send(1, Instruction.READ, POSITION),
        "w": bench.send(1, Instruction.WRITE, b"\x41\x00\x01"),
    }
    assert "".join(kind for kind, packets in replies.items() if packets) == answered
    assert len(bench.sync_read(132, 4, [1])) == (level >= 1)


def test_a_new_id_is_the_one_that_answers_from_then_on(trio: Any) -> None:
    assert trio.write_bytes(1, 7, b"\x0b") == 0
    assert trio.send(1, Instruction.PING) == []
    assert ids(trio.send(BROADCAST_ID, Instruction.PING)) == [2, 3, 11]


def test_clear_forgets_turns_at_standstill_only(bench: Any) -> None:
    clear = b"\x01\x44\x58\x4c\x22"
    bench.write("operating_mode", 4)
    bench.write("torque_enable", 1)
    bench.write("goal_position", 2048 + 8192)
    bench.run(0.5)
    assert bench.send(1, Instruction.CLEAR, clear)[0].error == StatusError.RESULT_FAIL
    bench.run(5.0)
    assert bench.read("present_position") == pytest.approx(2048 + 8192, abs=2)
    assert bench.send(1, Instruction.CLEAR, b"\x01\0\0\0\0")[0].error == StatusError.DATA_RANGE
    assert bench.send(1, Instruction.CLEAR, clear)[0].error == 0
    bench.run(0.5)
    assert bench.read("present_position") == pytest.approx(2048, abs=2)
    assert abs(bench.rotors.velocity_rad_s[0]) < 0.02


def test_a_status_packet_on_the_bus_is_no_instruction(trio: Any) -> None:
    assert trio.send(1, Instruction.STATUS, b"\x00") == []
    assert trio.send(BROADCAST_ID, Instruction.STATUS, b"\x00") == []


@pytest.mark.parametrize("instruction", [0x21, 0x30, 0xFF])
def test_an_unknown_instruction_is_refused(bench: Any, instruction: int) -> None:
    assert bench.send(1, instruction)[0].error == StatusError.INSTRUCTION


@pytest.mark.parametrize(
    "instruction",
    [Instruction.READ, Instruction.WRITE, Instruction.REG_WRITE, Instruction.FACTORY_RESET],
)
@pytest.mark.parametrize("params", [b"", b"\x84"])
def test_params_too_short_are_a_length_error(
    bench: Any, instruction: Instruction, params: bytes
) -> None:
    if (instruction, params) == (Instruction.FACTORY_RESET, b"\x84"):
        assert bench.send(1, instruction, params)[0].error == StatusError.DATA_RANGE
    else:
        assert bench.send(1, instruction, params)[0].error == StatusError.DATA_LENGTH


def test_replies_that_look_like_a_header_are_stuffed(bench: Any) -> None:
    bench.write("operating_mode", 4)
    bench.write("torque_enable", 1)
    looks_like_a_header = int.from_bytes(b"\xff\xff\xfd\xff", "little", signed=True)
    bench.write("goal_position", looks_like_a_header)
    params = struct.pack("<HH", 116, 4)
    bench.bank.receive(encode_instruction(1, Instruction.READ, params))
    raw = bench.bank.transmit()
    assert b"\xff\xff\xfd\xfd\xff" in raw
    assert bench.read("goal_position") == looks_like_a_header


def test_a_packet_may_arrive_in_pieces_but_not_with_a_pause(bench: Any) -> None:
    packet = encode_instruction(1, Instruction.PING)
    for byte in packet:
        assert bench.bank.transmit() == b""
        bench.bank.receive(bytes([byte]))
    assert bench.bank.transmit()
    bench.bank.receive(packet[:6])
    bench.run(0.004)
    bench.bank.receive(packet[6:])
    assert bench.bank.transmit() == b""
    assert bench.send(1, Instruction.PING)


@pytest.mark.parametrize("wrong", [[], [4, 4]])
def test_a_bus_needs_servos_with_different_ids(wrong: list[int]) -> None:
    with pytest.raises(ValueError, match="all different"):
        ServoBank([EmulatedServoSpec(id=n, model_name="XM430-W350") for n in wrong])
