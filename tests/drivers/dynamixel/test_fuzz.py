"""Damaged streams never crash or hang a parser, and nothing that was not sent comes out of it.

Damage is what a 16-bit CRC finds with certainty - up to three flipped bits, or a burst of up to 16
- and noise, cuts and repeated packets around it.
"""

import struct
from collections.abc import Callable
from random import Random

import pytest

from drivers.dynamixel.block import BlockRead
from drivers.dynamixel.codec import (
    Packet,
    PacketParser,
    encode_fast_status,
    encode_status,
)
from drivers.dynamixel.layout import DIRECT
from drivers.dynamixel.sync_read import Entry, ReplyCollector, SyncRead

IDS = (1, 2, 3, 4)
CAMPAIGN = [
    pytest.param(20_000, id="short"),
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


DAMAGES: tuple[Callable[[Random, bytearray], None], ...] = (
    flip_bits,
    burst,
    cut,
    noise_before,
    noise_behind,
    nothing,
)

WHOLE_REPLY_DAMAGES = tuple(damage for damage in DAMAGES if damage is not burst)
"""A burst anywhere in the reply would also cross the borders that `burst` avoids."""


def in_pieces(random: Random, data: bytes) -> list[bytes]:
    cuts = sorted(random.randrange(len(data) + 1) for _ in range(random.randint(0, 3)))
    return [data[a:b] for a, b in zip([0, *cuts], [*cuts, len(data)], strict=True)]


@pytest.mark.parametrize("streams", CAMPAIGN)
def test_only_packets_that_were_sent_come_out_of_the_parser(streams: int) -> None:
    random = Random(31)
    whole = 0
    for _ in range(streams):
        sent = entries(random)
        frames = [bytearray(encode_status(e.servo_id, e.error, e.data)) for e in sent]
        damaged = random.randrange(len(frames))
        random.choice(DAMAGES[:2] + DAMAGES[3:])(random, frames[damaged])
        parser = PacketParser()
        found: list[Packet] = []
        for piece in in_pieces(random, b"".join(frames)):
            parser.feed(piece)
            found += parser.packets()
        found += parser.salvage()
        assert parser.pending_bytes == 0
        got = [Entry(p.servo_id, p.error or 0, p.params) for p in found]
        assert all(entry in sent for entry in got)
        assert len(got) >= len(sent) - 1
        whole += len(got) == len(sent)
    assert whole > streams / 4


@pytest.mark.parametrize("fast", [False, True], ids=["plain", "fast"])
@pytest.mark.parametrize("streams", CAMPAIGN)
def test_only_values_that_were_sent_come_out_of_a_block_read(streams: int, fast: bool) -> None:
    random = Random(32)
    read = BlockRead(IDS, DIRECT, fast=fast)
    request = SyncRead(IDS, DIRECT.address, DIRECT.size, fast=fast)
    taken = 0
    for _ in range(streams):
        sent = entries(random)
        reply = bytearray(
            encode_fast_status([(e.error, e.servo_id, e.data) for e in sent])
            if fast
            else b"".join(encode_status(e.servo_id, e.error, e.data) for e in sent)
        )
        random.choice(WHOLE_REPLY_DAMAGES)(random, reply)
        collector = ReplyCollector(request)
        for piece in in_pieces(random, bytes(reply)):
            collector.feed(piece)
        got = collector.finish()
        assert all(entry in sent for entry in got.values())
        if read.take(bytes(reply)):
            taken += 1
            assert read.columns(["position"])[0].tolist() == [
                int.from_bytes(e.data[6:], "little", signed=True) for e in sent
            ]
            assert list(read.errors) == [e.error for e in sent]
    assert taken > streams / 20
