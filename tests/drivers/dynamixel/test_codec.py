"""Golden packets of the e-manual, round trips with stuffing anywhere, a robust parser."""

import pytest
from dynamixel_sdk.protocol2_packet_handler import Protocol2PacketHandler
from hypothesis import given, settings
from hypothesis import strategies as st

from drivers.dynamixel.wire.codec import (
    BROADCAST_ID,
    HEADER,
    MAX_LENGTH,
    Instruction,
    Packet,
    PacketParser,
    crc16,
    decode_fast_entries,
    encode_fast_status,
    encode_instruction,
    encode_status,
    stuff,
    table_crc16,
    unstuff,
)

STUFFED_BYTES = st.lists(
    st.sampled_from([b"\xff", b"\xfd", b"\x00", b"\xff\xff\xfd", HEADER, b"\x55", b"\x7a"]),
    max_size=24,
).map(b"".join)
SERVO_IDS = st.one_of(st.integers(0, 252), st.just(BROADCAST_ID))


def wire(text: str) -> bytes:
    return bytes.fromhex(text.replace(" ", ""))


# e-manual, "Protocol 2.0": the examples of ping, read, write, reboot, sync read and sync write.
INSTRUCTIONS = [
    (1, Instruction.PING, "", "FF FF FD 00 01 03 00 01 19 4E"),
    (BROADCAST_ID, Instruction.PING, "", "FF FF FD 00 FE 03 00 01 31 42"),
    (1, Instruction.READ, "84 00 04 00", "FF FF FD 00 01 07 00 02 84 00 04 00 1D 15"),
    (1, Instruction.WRITE, "74 00 00 02 00 00", "FF FF FD 00 01 09 00 03 74 00 00 02 00 00 CA 89"),
    (1, Instruction.REBOOT, "", "FF FF FD 00 01 03 00 08 2F 4E"),
    (
        BROADCAST_ID,
        Instruction.SYNC_READ,
        "84 00 04 00 01 02",
        "FF FF FD 00 FE 09 00 82 84 00 04 00 01 02 CE FA",
    ),
    (
        BROADCAST_ID,
        Instruction.SYNC_WRITE,
        "74 00 04 00 01 96 00 00 00 02 AA 00 00 00",
        "FF FF FD 00 FE 11 00 83 74 00 04 00 01 96 00 00 00 02 AA 00 00 00 82 87",
    ),
]
STATUSES = [
    (1, 0, "06 04 26", "FF FF FD 00 01 07 00 55 00 06 04 26 65 5D"),
    (1, 0, "A6 00 00 00", "FF FF FD 00 01 08 00 55 00 A6 00 00 00 8C C0"),
    (1, 0, "", "FF FF FD 00 01 04 00 55 00 A1 0C"),
]
FAST_ENTRIES = [
    (0, 3, wire("A6 00 00 00")),
    (0, 7, wire("1F 08 00 00")),
    (0, 4, wire("FF 03 00 00")),
]


@pytest.mark.parametrize(("servo_id", "instruction", "params", "expected"), INSTRUCTIONS)
def test_instructions_are_those_of_the_manual(
    servo_id: int, instruction: Instruction, params: str, expected: str
) -> None:
    assert encode_instruction(servo_id, instruction, wire(params)) == wire(expected)


@pytest.mark.parametrize(("servo_id", "error", "params", "expected"), STATUSES)
def test_statuses_are_those_of_the_manual(
    servo_id: int, error: int, params: str, expected: str
) -> None:
    assert encode_status(servo_id, error, wire(params)) == wire(expected)


def test_fast_sync_reply_carries_the_manuals_cumulative_crcs() -> None:
    frame = encode_fast_status(FAST_ENTRIES)
    assert frame[:8] == wire("FF FF FD 00 FE 19 00 55")
    crcs = [int.from_bytes(frame[end : end + 2], "little") for end in (14, 22, 30)]
    assert crcs == [0x0884, 0xCA16, 0x9ED1]


@given(data=st.binary(max_size=300))
def test_both_crcs_and_the_vendors_agree(data: bytes) -> None:
    vendor = Protocol2PacketHandler()
    assert crc16(data) == table_crc16(data) == vendor.updateCRC(0, list(data), len(data))


@given(payload=STUFFED_BYTES)
def test_stuffing_hides_every_header_and_is_undone_exactly(payload: bytes) -> None:
    assert HEADER not in stuff(payload)
    assert unstuff(stuff(payload)) == payload


@given(servo_id=SERVO_IDS, params=st.one_of(STUFFED_BYTES, st.binary(max_size=80)))
def test_an_instruction_survives_the_wire(servo_id: int, params: bytes) -> None:
    parser = PacketParser()
    parser.feed(encode_instruction(servo_id, Instruction.WRITE, params))
    assert parser.packets() == [Packet(servo_id, Instruction.WRITE, None, params)]
    assert (parser.crc_errors, parser.discarded_bytes, parser.pending_bytes) == (0, 0, 0)


@given(
    servo_id=st.integers(0, 252),
    error=st.integers(0, 255),
    params=st.one_of(STUFFED_BYTES, st.binary(max_size=80)),
    cuts=st.lists(st.integers(1, 7), max_size=40),
)
def test_a_status_survives_the_wire_in_any_pieces(
    servo_id: int, error: int, params: bytes, cuts: list[int]
) -> None:
    frame = encode_status(servo_id, error, params)
    parser = PacketParser()
    packets = []
    for cut in [*cuts, len(frame)]:
        parser.feed(frame[:cut])
        frame = frame[cut:]
        packets += parser.packets()
    assert packets == [Packet(servo_id, Instruction.STATUS, error, params)]


@pytest.mark.parametrize("position", range(11))
def test_a_header_in_the_data_is_stuffed_at_every_position(position: int) -> None:
    params = b"\x01" * position + HEADER + b"\x02" * (10 - position)
    frame = encode_status(7, 0, params)
    assert len(frame) == 11 + len(params) + 1
    parser = PacketParser()
    parser.feed(frame)
    assert parser.packets() == [Packet(7, Instruction.STATUS, 0, params)]


@given(noise=st.binary(max_size=60), params=STUFFED_BYTES)
def test_a_packet_is_found_behind_noise(noise: bytes, params: bytes) -> None:
    parser = PacketParser()
    parser.feed(noise + encode_status(9, 0, params))
    found = parser.packets() + parser.salvage()
    assert Packet(9, Instruction.STATUS, 0, params) in found


@settings(derandomize=True)  # one in 65536 wrong frames has a right CRC
@given(stream=st.lists(st.one_of(STUFFED_BYTES, st.binary(max_size=20)), max_size=20))
def test_random_streams_never_crash_nor_lose_count_of_bytes(stream: list[bytes]) -> None:
    parser = PacketParser()
    for chunk in stream:
        parser.feed(chunk)
        assert parser.packets() == []
    assert parser.discarded_bytes + parser.pending_bytes == sum(map(len, stream))
    parser.salvage()
    assert parser.pending_bytes == 0


def test_a_truncated_packet_does_not_swallow_the_next_one() -> None:
    parser = PacketParser()
    parser.feed(encode_status(1, 0, bytes(10))[:12] + encode_status(2, 0, b"ok"))
    assert parser.packets() + parser.salvage() == [Packet(2, Instruction.STATUS, 0, b"ok")]


def test_a_damaged_packet_is_counted_and_the_next_one_is_found() -> None:
    broken = bytearray(encode_status(1, 0, b"abc"))
    broken[9] ^= 1
    parser = PacketParser()
    parser.feed(bytes(broken) + encode_status(2, 0, b"ok"))
    assert parser.packets() == [Packet(2, Instruction.STATUS, 0, b"ok")]
    assert parser.crc_errors == 1
    assert parser.discarded_bytes == len(broken)


def test_reset_drops_the_unfinished_packet() -> None:
    parser = PacketParser()
    parser.feed(encode_instruction(1, Instruction.PING)[:-1])
    assert parser.packets() == []
    assert parser.pending_bytes == 9
    parser.reset()
    assert parser.pending_bytes == 0
    parser.feed(encode_instruction(1, Instruction.PING))
    assert len(parser.packets()) == 1


@given(
    entries=st.lists(
        st.tuples(st.integers(0, 255), st.integers(0, 252), st.binary(min_size=4, max_size=4)),
        min_size=1,
        max_size=8,
    ),
    cut=st.integers(0, 200),
)
def test_a_cut_fast_reply_yields_exactly_its_whole_entries(
    entries: list[tuple[int, int, bytes]], cut: int
) -> None:
    frame = encode_fast_status(entries)
    assert decode_fast_entries(frame, 4) == entries
    length = min(cut, len(frame))
    whole = max(0, (length - 8) // 8)
    assert decode_fast_entries(frame[:length], 4) == entries[:whole]


def test_a_fast_reply_passes_the_parser_without_unstuffing() -> None:
    entries = [(0, 1, b"\xff\xff\xfd\xfd")]
    parser = PacketParser()
    parser.feed(encode_fast_status(entries))
    (packet,) = parser.packets()
    assert packet.servo_id == BROADCAST_ID
    assert packet.error is None
    assert b"\xff\xff\xfd\xfd" in packet.params


@pytest.mark.parametrize("servo_id", [-1, 253, 255, 256])
def test_an_id_that_is_no_address_is_refused(servo_id: int) -> None:
    with pytest.raises(ValueError, match="servo id must be"):
        encode_instruction(servo_id, Instruction.PING)


def test_an_endless_packet_is_refused() -> None:
    with pytest.raises(ValueError, match="packet length"):
        encode_instruction(1, Instruction.WRITE, bytes(MAX_LENGTH))
    with pytest.raises(ValueError, match="at least one entry"):
        encode_fast_status([])
