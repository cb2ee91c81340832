"""The emulator's parser finds every whole packet and invents none, whatever bytes it is fed."""

import struct
from collections.abc import Iterator
from random import Random

import pytest

from drivers.dynamixel.wire.codec import (
    BROADCAST_ID,
    HEADER,
    MAX_LENGTH,
    MAX_SERVO_ID,
    Instruction,
    Packet,
    crc16,
    encode_instruction,
    unstuff,
)
from sim_twin.servos import EmulatedServoSpec, ServoBank
from sim_twin.servos.protocol.instructions import BrokenPacket, InstructionParser

PING = encode_instruction(1, Instruction.PING)
STREAMS, CAMPAIGN_STREAMS = 5_000, 1_000_000
INSTRUCTIONS = [*Instruction, 0x00, 0x21, 0xFF]


def whole(found: list[Packet | BrokenPacket]) -> list[Packet]:
    return [packet for packet in found if isinstance(packet, Packet)]


def test_packets_come_whole_in_pieces_and_several_at_once() -> None:
    parser = InstructionParser()
    expected = [Packet(1, Instruction.PING, None, b"")]
    assert parser.feed(PING) == expected
    assert parser.feed(PING + PING) == expected * 2
    found = [packet for byte in PING for packet in parser.feed(bytes([byte]))]
    assert found == expected
    assert parser.pending_bytes == 0


def test_stuffing_is_taken_out_of_params() -> None:
    params = b"\x74\x00\xff\xff\xfd\xff"
    packet = encode_instruction(3, Instruction.WRITE, params)
    assert InstructionParser().feed(packet) == [Packet(3, Instruction.WRITE, None, params)]


def test_a_broken_packet_is_reported_and_one_that_it_seems_to_swallow_is_found() -> None:
    parser = InstructionParser()
    swallowing = HEADER + struct.pack("<BHB", 7, 1 + len(PING) + 2, Instruction.READ)
    found = parser.feed(swallowing + PING + b"\x00\x00")
    assert found == [BrokenPacket(7, Instruction.READ), Packet(1, Instruction.PING, None, b"")]


@pytest.mark.parametrize("servo_id", [253, 255])
@pytest.mark.parametrize("length", [0, 2, MAX_LENGTH + 1])
def test_a_header_that_makes_no_sense_is_skipped(servo_id: int, length: int) -> None:
    nonsense = HEADER + struct.pack("<BH", servo_id, length)
    assert whole(InstructionParser().feed(nonsense + PING)) == [
        Packet(1, Instruction.PING, None, b"")
    ]


def test_a_reset_forgets_what_is_unfinished() -> None:
    parser = InstructionParser()
    parser.feed(PING[:6])
    parser.reset()
    assert parser.feed(PING[6:]) == []


def make_packet(random: Random) -> bytes:
    params = random.randbytes(random.randrange(12))
    if random.random() < 0.3:
        params += random.choice([b"\xff\xff\xfd", HEADER, PING, b"\xff\xff"])
    servo_id = random.choice([0, 1, 2, MAX_SERVO_ID, BROADCAST_ID])
    return encode_instruction(servo_id, random.choice(INSTRUCTIONS), params)


def damage(stream: bytes, random: Random) -> bytes:
    spoiled = bytearray(stream)
    for _ in range(random.randrange(4)):
        if not spoiled:
            break
        place = random.randrange(len(spoiled))
        match random.randrange(4):
            case 0:
                spoiled[place] ^= 1 << random.randrange(8)
            case 1:
                del spoiled[place : place + random.randrange(1, 6)]
            case 2:
                spoiled[place:place] = random.randbytes(random.randrange(1, 6))
            case _:
                spoiled[place:place] = HEADER
    return bytes(spoiled)


def make_stream(random: Random) -> bytes:
    return damage(b"".join(make_packet(random) for _ in range(random.randrange(1, 4))), random)


def valid_frames(stream: bytes) -> Iterator[Packet]:
    """Find every frame with a right check sum, at whatever header it starts."""
    start = stream.find(HEADER)
    while start >= 0:
        if start + 7 <= len(stream):
            end = start + 7 + struct.unpack_from("<H", stream, start + 5)[0]
            frame = stream[start:end]
            sums_up = end - start >= 10 and len(frame) == end - start
            if sums_up and crc16(frame[:-2]) == struct.unpack("<H", frame[-2:])[0]:
                yield Packet(frame[4], frame[7], None, unstuff(frame[7:-2])[1:])
        start = stream.find(HEADER, start + 1)


def fuzz(count: int, seed: int) -> None:
    random = Random(seed)
    parser = InstructionParser()
    servos = [EmulatedServoSpec(id=n, model_name="XM430-W350") for n in (1, 2)]
    bank, now_ns, accepted = ServoBank(servos), 0, 0
    for number in range(count):
        stream = make_stream(random)
        parser.reset()
        cut = random.randrange(len(stream) + 1)
        found = whole(parser.feed(stream[:cut]) + parser.feed(stream[cut:]))
        true = list(valid_frames(stream))
        assert all(packet in true for packet in found), stream.hex()
        assert parser.pending_bytes < MAX_LENGTH + 7
        accepted += len(found)
        now_ns += 2_000_000
        bank.step(now_ns)
        bank.receive(stream)
        bank.transmit()
        if number % 50 == 49:  # whatever ids they have by now
            now_ns += 1_000_000_000
            bank.step(now_ns)
            bank.receive(encode_instruction(BROADCAST_ID, Instruction.PING))
            assert bank.transmit(), f"silent after stream {number} of seed {seed}"
    assert accepted > count / 2  # most streams hold a packet that the damage has spared


def test_no_stream_breaks_parser_or_bus() -> None:
    fuzz(STREAMS, seed=1)


@pytest.mark.slow
@pytest.mark.timeout(1800)
def test_no_stream_of_a_long_campaign_breaks_parser_or_bus() -> None:
    fuzz(CAMPAIGN_STREAMS, seed=2)
