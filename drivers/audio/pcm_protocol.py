"""Define the PCM stream protocol, version 1: sound over a Unix or TCP stream, little-endian.

Both directions carry the same block:

    offset  size  meaning
    0       4     magic "VPCM"
    4       1     version, 1
    5       1     channels
    6       2     reserved, 0
    8       4     rate in Hz
    12      8     number of the first row since the stream began
    20      8     stamp of the first row, sender's nanoseconds
    28      4     payload length in bytes
    32      4     CRC-32 of bytes 0..31
    36      n     payload: int16 samples, channel by channel within each row
    36+n    4     CRC-32 of the payload
"""

import struct
import zlib
from dataclasses import dataclass
from typing import Final

import numpy as np

from drivers.audio.base import AudioFormat, Samples

MAGIC: Final = b"VPCM"
VERSION: Final = 1
MAX_PAYLOAD_BYTES: Final = 1 << 20
SAMPLE_BYTES: Final = 2
_HEADER: Final = struct.Struct("<4sBBHIQQI")
_CRC: Final = struct.Struct("<I")
_HEADER_BYTES: Final = _HEADER.size + _CRC.size


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PcmBlock:
    """Hold one block as it is on the wire."""

    format: AudioFormat
    first_row: int
    stamp_ns: int
    samples: Samples


@dataclass(frozen=True, slots=True)
class _Head:
    format: AudioFormat
    first_row: int
    stamp_ns: int
    payload_bytes: int


def encode_block(block: PcmBlock) -> bytes:
    """Return a block's bytes."""
    payload = np.ascontiguousarray(block.samples, dtype="<i2").tobytes()
    head = _HEADER.pack(
        MAGIC,
        VERSION,
        block.format.channels,
        0,
        block.format.rate_hz,
        block.first_row,
        block.stamp_ns,
        len(payload),
    )
    return b"".join((head, _CRC.pack(zlib.crc32(head)), payload, _CRC.pack(zlib.crc32(payload))))


class PcmParser:
    """Find the intact blocks in a stream of bytes; count what is none."""

    def __init__(self) -> None:
        self.crc_errors = 0
        self.discarded_bytes = 0
        self._buffer = bytearray()

    def feed(self, data: bytes) -> list[PcmBlock]:
        """Return the blocks that are complete now, oldest first."""
        self._buffer += data
        blocks = []
        while (block := self._next()) is not None:
            blocks.append(block)
        return blocks

    def _next(self) -> PcmBlock | None:
        while self._seek() and len(self._buffer) >= _HEADER_BYTES:
            head = _decode_head(bytes(self._buffer[:_HEADER_BYTES]))
            if head is None:
                self._reject()
                continue
            end = _HEADER_BYTES + head.payload_bytes
            if len(self._buffer) < end + _CRC.size:
                return None
            payload = bytes(self._buffer[_HEADER_BYTES:end])
            if zlib.crc32(payload) != _CRC.unpack_from(self._buffer, end)[0]:
                self._reject()
                continue
            del self._buffer[: end + _CRC.size]
            samples = np.frombuffer(payload, "<i2").reshape(-1, head.format.channels)
            return PcmBlock(
                format=head.format,
                first_row=head.first_row,
                stamp_ns=head.stamp_ns,
                samples=samples.astype(np.int16),
            )
        return None

    def _seek(self) -> bool:
        """Drop bytes up to the next magic; false when there is none yet."""
        at = self._buffer.find(MAGIC)
        self._discard(max(0, len(self._buffer) - len(MAGIC) + 1) if at < 0 else at)
        return at >= 0

    def _reject(self) -> None:
        self.crc_errors += 1
        self._discard(len(MAGIC))

    def _discard(self, count: int) -> None:
        self.discarded_bytes += count
        del self._buffer[:count]


def _decode_head(data: bytes) -> _Head | None:
    head, (crc,) = data[: _HEADER.size], _CRC.unpack_from(data, _HEADER.size)
    if zlib.crc32(head) != crc:
        return None
    _, version, channels, _, rate_hz, first_row, stamp_ns, length = _HEADER.unpack(head)
    try:
        format_ = AudioFormat(rate_hz=rate_hz, channels=channels)
    except ValueError:
        return None
    row_bytes = channels * SAMPLE_BYTES
    if version != VERSION or length % row_bytes or not 0 < length <= MAX_PAYLOAD_BYTES:
        return None
    return _Head(format_, first_row, stamp_ns, length)
