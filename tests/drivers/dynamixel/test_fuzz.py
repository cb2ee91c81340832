"""Damaged streams never crash or hang a parser, and no frame comes out whose CRC does not hold.

What a 16-bit CRC finds with certainty - up to three flipped bits, or two damaged neighbours on one
side of the border of data and CRC - never brings out anything that was not sent. Of what it finds
all but once in some 65,536 times - dropped or doubled bytes, bursts anywhere - only those come out
of which a second, plain implementation says that the CRC holds.
"""

import struct
from collections.abc import Callable
from random import Random

import pytest

from drivers.dynamixel.tables.layout import DIRECT
from drivers.dynamixel.wire.block import BlockRead
from drivers.dynamixel.wire.codec import (
    HEADER,
    Packet,
    PacketParser,
    encode_fast_status,
    encode_status,
    table_crc16,
    unstuff,
)
from drivers.dynamixel.wire.sync_read import Entry, ReplyCollector

IDS = (1, 2, 3, 4)
CAMPAIGN = [
    pytest.param(5_000, id="short"),
    pytest.param(1_000_000, id="long", marks=[pytest.mark.slow, pytest.mark.timeout(1800)]),
]


def entries(random: Random) -> list[Entry]:
    """Return values such as a servo has; slow negative speeds make stuffing common."""
    return [
        Entry(
            servo_id,
            random.choice((0, 0, 0, 0x80)),
            struct.pack(
                "<hii",
                random.randint(-50, 50),
                random.randint(-3, 3),
                random.choice((0x1FD, 0xFD, 2048, random.randint(0, 4095))),
            ),
        )
        for servo_id in IDS
    ]


def flip_bits(random: Random, data: bytearray) -> None:
    for _ in range(random.randint(1, 3)):
        data[random.randrange(len(data))] ^= 1 << random.randrange(8)


def burst(random: Random, data: bytearray) -> None:
    # not across the border of data and CRC: the CRC goes out low byte first, so that what are
    # neighbours on the wire are far apart in the polynomial
    at = random.randrange(len(data) - 3)
    data[at] ^= random.randint(1, 255)
    data[at + 1] ^= random.randint(0, 255)


def cut(random: Random, data: bytearray) -> None:
    del data[random.randrange(len(data)) :]


def noise_before(random: Random, data: bytearray) -> None:
    data[:0] = random.choice((b"\xff", b"\xff\xff\xfd", b"\x00", random.randbytes(7)))


def noise_behind(random: Random, data: bytearray) -> None:
    data += random.randbytes(random.randint(1, 12))


def nothing(_random: Random, _data: bytearray) -> None: ...


def drop(random: Random, data: bytearray) -> None:
    at = random.randrange(len(data) - 1)
    del data[at : at + random.randint(1, 4)]


def double(random: Random, data: bytearray) -> None:
    at = random.randrange(len(data) - 1)
    data[at:at] = data[at : at + random.randint(1, 25)]


def burst_anywhere(random: Random, data: bytearray) -> None:
    at = random.randrange(len(data) - 4)
    for place in range(at, at + random.randint(2, 4)):
        data[place] ^= random.randint(0, 255)


Damage = Callable[[Random, bytearray], None]

FOUND_WITH_CERTAINTY: tuple[Damage, ...] = (
    flip_bits,
    burst,
    noise_before,
    noise_behind,
    nothing,
)
FOUND_WITHIN_LUCK: tuple[Damage, ...] = (cut, drop, double, burst_anywhere)
CERTAIN_IN_WHOLE_REPLIES = (cut, *(one for one in FOUND_WITH_CERTAINTY if one is not burst))
"""A burst anywhere in the reply would also cross the borders that `burst` avoids."""
KINDS = [
    pytest.param(CERTAIN_IN_WHOLE_REPLIES, 0.0, id="certain"),
    pytest.param(FOUND_WITHIN_LUCK, 1e-3, id="lucky"),
]


def proved(stream: bytes) -> list[Entry]:
    """Return every status packet in a stream whose CRC holds, wherever it begins."""
    found = []
    for start in places(stream, HEADER):
        end = start + 7 + int.from_bytes(stream[start + 5 : start + 7], "little")
        frame = stream[start:end]
        if len(frame) >= 11 and end <= len(stream) and crc_holds(frame) and frame[7] == 0x55:
            found.append(Entry(frame[4], frame[8], unstuff(frame[7:-2])[2:]))
    return found


def proved_fast(stream: bytes) -> list[Entry]:
    """Return every part of a fast reply in a stream that its CRC covers, with all before it."""
    found = []
    for start in places(stream, HEADER):
        for at in range(start + 8, len(stream) - DIRECT.size - 3, DIRECT.size + 4):
            part = stream[at : at + DIRECT.size + 4]
            if crc_holds(stream[start : at + DIRECT.size + 4]):
                found.append(Entry(part[1], part[0], part[2:-2]))
    return found


def places(stream: bytes, wanted: bytes) -> list[int]:
    return [at for at in range(len(stream)) if stream.startswith(wanted, at)]


def crc_holds(frame: bytes) -> bool:
    return table_crc16(frame[:-2]) == int.from_bytes(frame[-2:], "little")


def in_pieces(random: Random, data: bytes) -> list[bytes]:
    cuts = sorted(random.randrange(len(data) + 1) for _ in range(random.randint(0, 3)))
    return [data[a:b] for a, b in zip([0, *cuts], [*cuts, len(data)], strict=True)]


def parsed(random: Random, stream: bytes) -> list[Entry]:
    parser = PacketParser()
    found: list[Packet] = []
    for piece in in_pieces(random, stream):
        parser.feed(piece)
        found += parser.packets()
    found += parser.salvage()
    assert parser.pending_bytes == 0
    # An instruction whose CRC holds by luck is no answer: the link takes none for one.
    return [Entry(p.servo_id, p.error, p.params) for p in found if p.error is not None]


@pytest.mark.parametrize("streams", CAMPAIGN)
def test_only_packets_that_were_sent_come_out_of_the_parser(streams: int) -> None:
    random = Random(31)
    whole = 0
    for _ in range(streams):
        sent = entries(random)
        frames = [bytearray(encode_status(e.servo_id, e.error, e.data)) for e in sent]
        random.choice(FOUND_WITH_CERTAINTY)(random, random.choice(frames))
        got = parsed(random, b"".join(frames))
        assert all(entry in sent for entry in got)
        assert len(got) >= len(sent) - 1
        whole += len(got) == len(sent)
    assert whole > streams / 4


@pytest.mark.parametrize("streams", CAMPAIGN)
def test_no_packet_comes_out_of_the_parser_whose_crc_does_not_hold(streams: int) -> None:
    random = Random(33)
    wrong = 0
    for _ in range(streams):
        sent = entries(random)
        frames = [bytearray(encode_status(e.servo_id, e.error, e.data)) for e in sent]
        random.choice(FOUND_WITHIN_LUCK)(random, random.choice(frames))
        stream = b"".join(frames)
        strange = [entry for entry in parsed(random, stream) if entry not in sent]
        assert not strange or all(entry in proved(stream) for entry in strange)
        wrong += bool(strange)
    assert wrong < streams / 1000


def test_a_burst_across_the_border_of_data_and_crc_may_hold_by_luck() -> None:
    frame = bytearray(encode_status(1, 0, bytes(10)))
    frame[-3] ^= 0x03
    frame[-2] ^= 0x0A
    assert crc_holds(bytes(frame))


@pytest.mark.parametrize("fast", [False, True], ids=["plain", "fast"])
@pytest.mark.parametrize(("damages", "luck"), KINDS)
@pytest.mark.parametrize("streams", CAMPAIGN)
def test_only_values_whose_crc_holds_come_out_of_a_block_read(
    streams: int, damages: tuple[Damage, ...], luck: float, fast: bool
) -> None:
    random = Random(32)
    read = BlockRead(IDS, DIRECT, fast=fast)
    wrong = 0
    for _ in range(streams):
        sent = entries(random)
        reply = bytearray(
            encode_fast_status([(e.error, e.servo_id, e.data) for e in sent])
            if fast
            else b"".join(encode_status(e.servo_id, e.error, e.data) for e in sent)
        )
        random.choice(damages)(random, reply)
        stream = bytes(reply)
        collector = ReplyCollector(read.sync_read)
        for piece in in_pieces(random, stream):
            collector.feed(piece)
        got = [*collector.finish().values(), *taken(read, stream)]
        strange = [entry for entry in got if entry not in sent]
        if strange:
            holding = (proved_fast if fast else proved)(stream)
            assert all(entry in holding for entry in strange)
        wrong += bool(strange)
    assert wrong <= streams * luck


@pytest.mark.parametrize("fast", [False, True], ids=["plain", "fast"])
def test_a_block_read_takes_an_undamaged_reply_without_stuffing_at_once(fast: bool) -> None:
    random = Random(34)
    read = BlockRead(IDS, DIRECT, fast=fast)
    for _ in range(2000):
        sent = [
            e._replace(data=e.data.replace(b"\xff\xff\xfd", b"\x01\x02\x03"))
            for e in entries(random)
        ]
        reply = (
            encode_fast_status([(e.error, e.servo_id, e.data) for e in sent])
            if fast
            else b"".join(encode_status(e.servo_id, e.error, e.data) for e in sent)
        )
        assert taken(read, reply) == sent


def taken(read: BlockRead, stream: bytes) -> list[Entry]:
    """Return what the short way makes of a reply, rebuilt from its columns."""
    if not read.take(stream):
        return []
    columns = [read.columns([name])[0].tolist() for name in ("effort", "velocity", "position")]
    return [
        Entry(servo_id, error, struct.pack("<hii", *values))
        for servo_id, error, values in zip(
            IDS, read.errors, zip(*columns, strict=True), strict=True
        )
    ]
