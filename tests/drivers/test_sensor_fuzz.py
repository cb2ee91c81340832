"""Broken streams by the thousand: each parser accepts just what an independent one accepts.

The second parsers below are written from the protocols' tables alone, slowly and plainly: a frame
counts where its header stands and its check sum holds, and the search goes on behind it. A driver
that crashes, hangs, misses a frame or accepts a wrong one differs from them.
"""

import random
import struct
import zlib
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import pytest

from drivers.audio.pcm_protocol import PcmParser
from drivers.camera.rgbd_stream import RgbdCamera
from drivers.estop.hid_button import HidButton
from drivers.imu.bno085_rvc import Bno085Rvc
from drivers.lidar.ld19 import Ld19
from sim_twin.contracts.scripted import ManualClock, ScriptedLine

KEY = 288
EVENT_BYTES = struct.calcsize("@llHHi")

Frames = list[Any]


def sealed(data: bytes) -> bytes:
    return data + struct.pack("<I", zlib.crc32(data))


# --- LD19 -------------------------------------------------------------------------------------


def crc_step(crc: int) -> int:
    for _ in range(8):
        crc = (crc << 1 ^ 0x4D) & 0xFF if crc & 0x80 else crc << 1
    return crc


CRC_STEPS = [crc_step(crc) for crc in range(256)]


def lidar_crc(data: bytes) -> int:
    crc = 0
    for byte in data:
        crc = CRC_STEPS[crc ^ byte]
    return crc


def lidar_frame(chance: random.Random) -> bytes:
    """Return a packet with the right check sum; every third says what no lidar would."""
    start = chance.randrange(36_000)
    end, stamp = (start + 880) % 36_000, chance.randrange(30_000)
    if chance.random() < 0.3:
        start, end, stamp = (chance.randrange(65_536) for _ in range(3))
    body = struct.pack("<BBHH", 0x54, 0x2C, chance.randrange(65_536), start)
    body += chance.randbytes(36) + struct.pack("<HH", end, stamp)
    return body + bytes((lidar_crc(body),))


def lidar_oracle(stream: bytes) -> Frames:
    frames, at = [], 0
    while (at := stream.find(b"\x54\x2c", at)) >= 0 and at + 47 <= len(stream):
        if lidar_crc(stream[at : at + 46]) == stream[at + 46]:
            frames.append(None)
            at += 47
        else:
            at += 1
    return frames


def lidar_driver(pieces: list[bytes]) -> Frames:
    line, clock = ScriptedLine(), ManualClock(10**9)
    lidar = Ld19(line, clock)
    for piece in pieces:
        line.pending += piece
        clock.ns += 3_000_000
        if (scan := lidar.poll()) is not None:
            assert (scan.range_m >= 0.0).all()
    counters = lidar.counters
    assert counters.discarded_bytes <= sum(map(len, pieces))
    return [None] * counters.packets


# --- BNO085 -----------------------------------------------------------------------------------


def imu_frame(chance: random.Random) -> bytes:
    body = chance.randbytes(16)
    return b"\xaa\xaa" + body + bytes((sum(body) & 0xFF,))


def imu_oracle(stream: bytes) -> Frames:
    """Return index and yaw of each frame; one with the last one's index is a stuck sensor's."""
    frames: Frames = []
    at = 0
    while (at := stream.find(b"\xaa\xaa", at)) >= 0 and at + 19 <= len(stream):
        body = stream[at + 2 : at + 18]
        if sum(body) & 0xFF == stream[at + 18]:
            if not frames or frames[-1][0] != body[0]:
                frames.append((body[0], struct.unpack_from("<h", body, 1)[0]))
            at += 19
        else:
            at += 1
    return frames


def imu_driver(pieces: list[bytes]) -> Frames:
    line = ScriptedLine()
    imu = Bno085Rvc(line, ManualClock(10**9))
    frames = []
    for piece in pieces:
        line.pending += piece
        frames += [(s.index, round(s.yaw_rad / 0.000174532925)) for s in imu.poll()]
    return frames


# --- RGB-D stream -----------------------------------------------------------------------------


def rgbd_frame(chance: random.Random) -> bytes:
    width, height = chance.randrange(4), chance.randrange(3)
    payload = chance.randbytes(5 * width * height)
    version = 1 if chance.random() < 0.9 else 2
    head = struct.pack(
        "<4sB3xIQ", b"VRGB", version, chance.randrange(1000), chance.randrange(2**40)
    )
    head += struct.pack("<HHfffffI", width, height, 1.0, 1.0, 0.0, 0.0, 0.001, len(payload))
    return sealed(head) + sealed(payload)


def rgbd_oracle(stream: bytes) -> Frames:
    """Return sequence and payload of each frame; the same shot again is a stuck camera's."""
    frames, at, last_shot = [], 0, b""
    while (at := stream.find(b"VRGB", at)) >= 0 and at + 52 <= len(stream):
        head = stream[at : at + 48]
        version, sequence, width, height, length = struct.unpack("<4xB3xI8xHH20xI", head)
        good = sealed(head) == stream[at : at + 52] and version == 1
        if not good or width * height == 0 or length != 5 * width * height:
            at += 4
            continue
        payload = stream[at + 52 : at + 52 + length]
        seal = stream[at + 52 + length : at + 56 + length]
        if len(seal) < 4:
            break
        if sealed(payload) == payload + seal:
            if head[8:20] != last_shot:
                frames.append((sequence, payload))
            last_shot = head[8:20]
            at += 56 + length
        else:
            at += 4
    return frames


def rgbd_driver(pieces: list[bytes]) -> Frames:
    line, clock = ScriptedLine(), ManualClock(10**9)
    camera = RgbdCamera(line, clock)
    frames: Frames = []
    superseded = 0
    for piece in pieces:
        line.pending += piece
        if (frame := camera.poll()) is not None:
            missed = camera.counters.superseded_frames - superseded
            superseded += missed
            frames += [...] * missed
            frames.append((frame.sequence, frame.rgb.tobytes() + frame.depth.tobytes()))
    return frames


# --- PCM stream -------------------------------------------------------------------------------


def pcm_frame(chance: random.Random) -> bytes:
    channels = chance.randrange(4)
    payload = chance.randbytes(2 * channels * chance.randrange(5))
    rate_hz = chance.choice((16_000, 48_000, 0))
    head = struct.pack("<4sBBHI", b"VPCM", 1, channels, 0, rate_hz)
    return sealed(head + struct.pack("<QQI", chance.randrange(2**40), 7, len(payload))) + sealed(
        payload
    )


def pcm_oracle(stream: bytes) -> Frames:
    frames, at = [], 0
    while (at := stream.find(b"VPCM", at)) >= 0 and at + 36 <= len(stream):
        head = stream[at : at + 32]
        version, channels, rate_hz, row, length = struct.unpack("<4xBB2xIQ8xI", head)
        good = sealed(head) == stream[at : at + 36] and version == 1 and rate_hz >= 1000
        if not good or not channels or not length or length % (2 * channels):
            at += 4
            continue
        payload = stream[at + 36 : at + 36 + length]
        seal = stream[at + 36 + length : at + 40 + length]
        if len(seal) < 4:
            break
        if sealed(payload) == payload + seal:
            frames.append((row, payload))
            at += 40 + length
        else:
            at += 4
    return frames


def pcm_driver(pieces: list[bytes]) -> Frames:
    parser = PcmParser()
    blocks = [block for piece in pieces for block in parser.feed(piece)]
    return [(block.first_row, block.samples.astype("<i2").tobytes()) for block in blocks]


# --- input events -----------------------------------------------------------------------------


def event_frame(chance: random.Random) -> bytes:
    kind, code = chance.choice(((1, KEY), (1, KEY), (0, 0), (1, 30), (4, 4), (0, 3)))
    value = chance.randrange(3) if kind == 1 else 0
    return struct.pack(
        "@llHHi", chance.randrange(10**6), chance.randrange(10**6), kind, code, value
    )


def event_oracle(stream: bytes) -> Frames:
    """Return the state that the events leave, for ever "lost" behind the first that is none."""
    state = "unknown"
    for at in range(0, len(stream) - EVENT_BYTES + 1, EVENT_BYTES):
        s, us, kind, code, value = struct.unpack_from("@llHHi", stream, at)
        sane = s >= 0 and 0 <= us < 10**6 and kind <= 0x1F and code <= 0x2FF
        if not sane or (kind == 1 and value not in (0, 1, 2)) or (kind, code) == (0, 3):
            return ["lost"]
        if (kind, code) == (1, KEY):
            state = "pressed" if value else "released"
    return [state]


def event_driver(pieces: list[bytes]) -> Frames:
    line = ScriptedLine()
    button = HidButton(line, ManualClock(10**9), KEY)
    reading = button.poll()
    for piece in pieces:
        line.pending += piece
        reading = button.poll()
    assert reading.pressed is (reading.state.value != "released")
    return [reading.state.value]


# --- streams ----------------------------------------------------------------------------------


@dataclass(frozen=True)
class Parser:
    frame: Callable[[random.Random], bytes]
    oracle: Callable[[bytes], Frames]
    driver: Callable[[list[bytes]], Frames]
    header: bytes


PARSERS = {
    "ld19": Parser(lidar_frame, lidar_oracle, lidar_driver, b"\x54\x2c"),
    "bno085": Parser(imu_frame, imu_oracle, imu_driver, b"\xaa\xaa\xaa"),
    "rgbd": Parser(rgbd_frame, rgbd_oracle, rgbd_driver, b"VRGB"),
    "pcm": Parser(pcm_frame, pcm_oracle, pcm_driver, b"VPCM"),
    "input_event": Parser(event_frame, event_oracle, event_driver, bytes(16)),
}


def changed(frame: bytes, chance: random.Random) -> bytes:
    """Return the frame with one byte changed, cut off, dropped or doubled."""
    at, how = chance.randrange(len(frame)), chance.randrange(4)
    if how == 0:
        return frame[:at] + bytes((frame[at] ^ chance.randrange(1, 256),)) + frame[at + 1 :]
    if how == 1:
        return frame[:at]
    return frame[:at] + frame[at + 1 :] if how == 2 else frame[: at + 1] + frame[at:]


def stream_of(parser: Parser, pool: list[bytes], chance: random.Random) -> bytes:
    parts = []
    for _ in range(chance.randrange(1, 6)):
        kind = chance.random()
        if kind < 0.4:
            parts.append(chance.choice(pool))
        elif kind < 0.75:
            parts.append(changed(chance.choice(pool), chance))
        elif kind < 0.9:
            parts.append(chance.randbytes(chance.randrange(60)))
        else:
            parts.append(parser.header)
    return b"".join(parts)


def cut(stream: bytes, chance: random.Random) -> list[bytes]:
    """Return the stream as it may arrive: at once, in a few pieces, or byte by byte."""
    if chance.random() < 0.02:
        return [stream[i : i + 1] for i in range(len(stream))]
    ends = sorted(chance.randrange(len(stream) + 1) for _ in range(chance.randrange(3)))
    return [stream[a:b] for a, b in zip([0, *ends], [*ends, len(stream)], strict=True)]


def same(found: Frames, expected: Frames) -> bool:
    """Compare, knowing nothing of frames that a newer one has superseded."""
    return len(found) == len(expected) and all(
        f is ... or f == e for f, e in zip(found, expected, strict=True)
    )


def campaign(name: str, count: int, seed: int) -> int:
    """Return how many frames were accepted on the way."""
    parser, chance = PARSERS[name], random.Random(seed)
    pool = [parser.frame(chance) for _ in range(200)]
    accepted = 0
    for number in range(count):
        stream = stream_of(parser, pool, chance)
        found, expected = parser.driver(cut(stream, chance)), parser.oracle(stream)
        assert same(found, expected), f"stream {number} of seed {seed}: {stream.hex()}"
        accepted += len(expected)
    return accepted


@pytest.mark.parametrize("name", PARSERS)
def test_of_5_000_broken_streams_just_the_true_frames_are_accepted(name: str) -> None:
    assert campaign(name, 5_000, seed=1) > 2_000


@pytest.mark.slow
@pytest.mark.timeout(3600)
@pytest.mark.parametrize("name", PARSERS)
def test_of_a_million_broken_streams_just_the_true_frames_are_accepted(name: str) -> None:
    assert campaign(name, 1_000_000, seed=2) > 400_000
