"""Sound over a stream: blocks as documented, gaps kept as silence, formats held to the file."""

import struct
import zlib

import numpy as np
import pytest

from drivers.audio.base import AudioFormat, Samples
from drivers.audio.pcm_protocol import PcmBlock, PcmParser, encode_block
from drivers.audio.pcm_stream import PcmInput, PcmOutput
from drivers.clock import NS_PER_S
from drivers.errors import WrongDevice
from sim_twin.contracts.scripted import ManualClock, ScriptedLine

MONO = AudioFormat(rate_hz=16_000)


def block(first_row: int, *values: int, format_: AudioFormat = MONO) -> bytes:
    """Encode independently of the driver, straight from the protocol's table."""
    payload = struct.pack(f"<{len(values)}h", *values)
    head = b"VPCM" + bytes([1, format_.channels, 0, 0]) + struct.pack("<I", format_.rate_hz)
    head += struct.pack("<QQI", first_row, first_row * 62_500, len(payload))
    return b"".join(part + struct.pack("<I", zlib.crc32(part)) for part in (head, payload))


def rows(*values: int) -> Samples:
    return np.array(values, np.int16)[:, None]


def test_a_block_is_encoded_as_documented() -> None:
    made = PcmBlock(format=MONO, first_row=5, stamp_ns=5 * 62_500, samples=rows(1, -2, 3))
    assert encode_block(made) == block(5, 1, -2, 3)


def test_blocks_in_pieces_are_joined_and_stamped() -> None:
    line, clock = ScriptedLine(), ManualClock(NS_PER_S)
    microphone = PcmInput(line, clock, MONO)
    data = block(0, 1, 2) + block(2, 3, 4)
    line.pending += data[:50]
    first = microphone.poll()
    line.pending += data[50:]
    clock.ns += 2 * 62_500
    second = microphone.poll()
    assert first is not None
    assert second is not None
    assert first.samples[:, 0].tolist() == [1, 2]
    assert second.samples[:, 0].tolist() == [3, 4]
    assert second.stamp_ns - first.stamp_ns == 2 * 62_500
    assert second.ratio()[0, 0] == pytest.approx(3 / 32768)


def test_lost_rows_are_counted_and_silence_keeps_the_times_true() -> None:
    line = ScriptedLine(pending=bytearray(block(0, 7, 7) + block(5, 8)))
    microphone = PcmInput(line, ManualClock(NS_PER_S), MONO)
    got = microphone.poll()
    assert got is not None
    assert got.samples[:, 0].tolist() == [7, 7, 0, 0, 0, 8]
    assert microphone.counters.lost_samples == 3


def test_another_format_than_declared_is_the_wrong_device() -> None:
    other = AudioFormat(rate_hz=48_000, channels=2)
    line = ScriptedLine(pending=bytearray(block(0, 1, 2, format_=other)))
    with pytest.raises(WrongDevice, match="48000 Hz, 2 channels got; correct the robot file"):
        PcmInput(line, ManualClock(NS_PER_S), MONO).poll()


def test_a_speaker_is_never_more_than_a_quarter_of_a_second_ahead() -> None:
    line, clock = ScriptedLine(), ManualClock(NS_PER_S)
    speaker = PcmOutput(line, clock, MONO)
    second = np.ones((16_000, 1), np.int16)
    assert speaker.write(second) == 4_000
    assert speaker.write(second) == 0
    clock.ns += NS_PER_S // 10
    assert speaker.write(second) == 1_600
    (first, following) = PcmParser().feed(bytes(line.sent))
    assert (first.first_row, following.first_row) == (0, 4_000)
    assert following.stamp_ns == first.stamp_ns + NS_PER_S // 4


@pytest.mark.parametrize(("rate_hz", "channels"), [(0, 1), (999, 1), (200_000, 1), (8_000, 0)])
def test_an_impossible_format_is_refused(rate_hz: int, channels: int) -> None:
    with pytest.raises(ValueError, match="expected a rate"):
        AudioFormat(rate_hz=rate_hz, channels=channels)
