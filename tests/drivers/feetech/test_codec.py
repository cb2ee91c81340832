"""Packets byte by byte as the vendor prints them, and out of streams of any kind."""

from random import Random

import pytest

from drivers.feetech.codec import (
    FEETECH_BROADCAST_ID,
    MAX_PARAMS,
    FeetechInstruction,
    FeetechPacket,
    FeetechParser,
    encode_packet,
)
from drivers.feetech.table import FEETECH_MODELS, FeetechRegister, hardware_errors
from drivers.servo.hardware_error import HardwareError

CAMPAIGN = [
    pytest.param(5_000, id="short"),
    pytest.param(1_000_000, id="long", marks=[pytest.mark.slow, pytest.mark.timeout(1800)]),
]
GOLDEN = [
    ("FF FF 01 02 01 FB", 1, FeetechInstruction.PING, ""),
    ("FF FF 01 02 00 FC", 1, 0, ""),
    ("FF FF 01 04 02 38 02 BE", 1, FeetechInstruction.READ, "38 02"),
    ("FF FF 01 04 00 18 05 DD", 1, 0, "18 05"),
    ("FF FF 01 09 03 2A 00 08 00 00 E8 03 D5", 1, 3, "2A 00 08 00 00 E8 03"),
    ("FF FF FE 02 05 FA", FEETECH_BROADCAST_ID, FeetechInstruction.ACTION, ""),
    ("FF FF 01 02 0A F2", 1, FeetechInstruction.RESET_STATE, ""),
]
"""As in "SMS/STS communication protocol"."""


@pytest.mark.parametrize(("wire", "servo_id", "code", "params"), GOLDEN)
def test_packets_are_those_of_the_vendor(wire: str, servo_id: int, code: int, params: str) -> None:
    frame = bytes.fromhex(wire)
    assert encode_packet(servo_id, code, bytes.fromhex(params)) == frame
    assert FeetechParser().feed(frame) == [FeetechPacket(servo_id, code, bytes.fromhex(params))]


@pytest.mark.parametrize(("servo_id", "params"), [(-1, 0), (255, 0), (1, MAX_PARAMS + 1)])
def test_what_is_no_packet_is_refused(servo_id: int, params: int) -> None:
    with pytest.raises(ValueError, match="got"):
        encode_packet(servo_id, 1, bytes(params))


@pytest.mark.parametrize(
    "before", ["", "00 41", "FF", "FF FF FF", "FF FF 01", "FF FF 01 FC 00", "FF FF 01 02 00 00"]
)
def test_a_whole_packet_is_found_behind_anything(before: str) -> None:
    parser = FeetechParser()
    frame = encode_packet(7, 0, b"\x18\x05")
    found = [*parser.feed(bytes.fromhex(before)), *parser.feed(frame), *parser.salvage()]
    assert found == [FeetechPacket(7, 0, b"\x18\x05")]
    assert parser.pending_bytes == 0


def test_a_packet_may_come_a_byte_at_a_time() -> None:
    parser = FeetechParser()
    frames = encode_packet(1, 0, b"\xff\xff\x01") + encode_packet(2, 32, b"")
    found = [packet for byte in frames for packet in parser.feed(bytes([byte]))]
    assert found == [FeetechPacket(1, 0, b"\xff\xff\x01"), FeetechPacket(2, 32, b"")]
    assert (parser.discarded_bytes, parser.check_errors) == (0, 0)


def holds(packet: FeetechPacket) -> bool:
    """Check a packet by a second, plain reading of the rule."""
    total = packet.servo_id + len(packet.params) + 2 + packet.code + sum(packet.params)
    return encode_packet(packet.servo_id, packet.code, packet.params)[-1] == 255 - total % 256


@pytest.mark.parametrize("streams", CAMPAIGN)
def test_damaged_streams_end_and_bring_out_no_frame_whose_check_sum_fails(streams: int) -> None:
    random = Random(41)
    parser = FeetechParser()
    fed = found_bytes = 0
    for _ in range(streams):
        size = random.randint(0, 12)
        frame = bytearray(
            encode_packet(
                random.randint(0, 253), random.choice((0, 0, 1, 32)), random.randbytes(size)
            )
        )
        for _ in range(random.randint(0, 3)):
            at = random.randrange(len(frame))
            frame[at : at + random.randint(0, 2)] = random.randbytes(random.randint(0, 3))
            if not frame:
                frame = bytearray(b"\xff")
        fed += len(frame)
        found = parser.feed(bytes(frame))
        assert all(map(holds, found))
        found_bytes += sum(len(packet.params) + 6 for packet in found)
    found_bytes += sum(len(packet.params) + 6 for packet in parser.salvage())
    assert fed == found_bytes + parser.discarded_bytes
    assert parser.pending_bytes == 0


@pytest.mark.parametrize("name", FEETECH_MODELS)
def test_registers_lie_apart_and_hold_all_that_they_say(name: str) -> None:
    registers = FEETECH_MODELS[name].registers.values()
    taken: set[int] = set()
    for register in registers:
        place = set(range(register.address, register.address + register.size))
        assert not place & taken, register
        taken |= place
        for value in (register.minimum, register.maximum, register.initial):
            assert register.from_bytes(register.to_bytes(value)) == value
        with pytest.raises(OverflowError, match=register.name):
            register.to_bytes(register.maximum + 1)


@pytest.mark.parametrize(
    ("model", "name", "value", "raw"),
    [
        ("STS3215-C018", "present_position", -5, "05 80"),
        ("STS3215-C018", "homing_offset", -2047, "FF 0F"),
        ("STS3215-C018", "present_load", -1000, "E8 07"),
        ("STS3215-C018", "goal_position", 2048, "00 08"),
        ("SCS0009", "goal_position", 511, "01 FF"),
    ],
)
def test_negative_is_a_bit_and_scs_is_the_other_way_round(
    model: str, name: str, value: int, raw: str
) -> None:
    register = FEETECH_MODELS[model].registers[name]
    assert register.to_bytes(value) == bytes.fromhex(raw)
    assert register.from_bytes(bytes.fromhex(raw)) == value


def test_minus_zero_is_zero() -> None:
    register = FeetechRegister(name="speed", address=58, size=2, sign_bit=15)
    assert register.from_bytes(b"\x00\x80") == 0


def test_errors_are_those_of_all_families() -> None:
    assert hardware_errors(0x00) == hardware_errors(0x50) == 0
    assert HardwareError(hardware_errors(0x2F)) == (
        HardwareError.INPUT_VOLTAGE
        | HardwareError.ENCODER
        | HardwareError.OVERHEATING
        | HardwareError.OVERCURRENT
        | HardwareError.OVERLOAD
    )
