"""Define the RGB-D stream protocol, version 1, between a depth camera's server and this stack.

No depth camera ships an open byte protocol, so a small server next to the vendor's SDK (or the
twin) speaks this one over a Unix or TCP stream. Everything is little-endian.

Frame, camera to host:

    offset  size  meaning
    0       4     magic "VRGB"
    4       1     version, 1
    5       1     reserved, 0
    6       2     from exposure until this header is sent, in 0.1 ms; 0 where that is not known
    8       4     sequence, counts up by one per exposed frame
    12      8     exposure stamp, device nanoseconds (middle of the exposure)
    20      4     width, height: uint16 each
    24      16    fx, fy, cx, cy in pixels: float32 each
    40      4     depth unit in metres: float32
    44      4     payload length in bytes
    48      4     CRC-32 of bytes 0..47
    52      n     payload: RGB uint8 row by row, then depth uint16 row by row (0 is no depth)
    52+n    4     CRC-32 of the payload

Request, host to camera: magic "VRGC", version 1 (uint8), command (uint8: 0 stop, 1 start), rate in
0.1 Hz (uint16), CRC-32 of these 8 bytes. START while streaming changes the rate.
"""

import struct
import zlib
from dataclasses import dataclass
from enum import IntEnum

FRAME_MAGIC = b"VRGB"
REQUEST_MAGIC = b"VRGC"
VERSION = 1
MAX_PIXELS = 1920 * 1200
BYTES_PER_PIXEL = 5
_SENT_AFTER_UNIT_NS = 100_000
CRC = struct.Struct("<I")
_HEADER = struct.Struct("<4sBxHIQHHfffffI")
HEADER_BYTES = _HEADER.size + CRC.size
_REQUEST = struct.Struct("<4sBBH")
REQUEST_BYTES = _REQUEST.size + CRC.size


class CameraCommand(IntEnum):
    """Name the requests a host may send."""

    STOP = 0
    START = 1


@dataclass(frozen=True, slots=True, kw_only=True)
class Intrinsics:
    """Hold a camera's calibration in pixels.

    `distortion` has the lens' coefficients in the order k1 k2 p1 p2 k3 k4 k5 k6, the last ones left
    out or all of them: a pinhole. The wire tells a pinhole only; a calibration file the lens.
    """

    width: int
    height: int
    fx: float
    fy: float
    cx: float
    cy: float
    distortion: tuple[float, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class FrameHeader:
    """Hold what precedes a payload; `sent_after_ns` counts from the exposure, 0: not known."""

    sequence: int
    exposure_ns: int
    intrinsics: Intrinsics
    depth_unit_m: float
    sent_after_ns: int = 0

    @property
    def payload_bytes(self) -> int:
        """Return the payload's length."""
        return self.intrinsics.width * self.intrinsics.height * BYTES_PER_PIXEL


def encode_header(header: FrameHeader) -> bytes:
    """Return the header's bytes with their CRC."""
    camera = header.intrinsics
    packed = _HEADER.pack(
        FRAME_MAGIC,
        VERSION,
        min(header.sent_after_ns // _SENT_AFTER_UNIT_NS, 0xFFFF),
        header.sequence & 0xFFFF_FFFF,
        header.exposure_ns,
        camera.width,
        camera.height,
        camera.fx,
        camera.fy,
        camera.cx,
        camera.cy,
        header.depth_unit_m,
        header.payload_bytes,
    )
    return packed + CRC.pack(zlib.crc32(packed))


def decode_header(data: bytes) -> FrameHeader | None:
    """Return the header, or None where CRC, version or sizes are wrong."""
    packed, (crc,) = data[: _HEADER.size], CRC.unpack_from(data, _HEADER.size)
    if zlib.crc32(packed) != crc:
        return None
    _, version, sent_after, sequence, exposure_ns, width, height, fx, fy, cx, cy, unit_m, length = (
        _HEADER.unpack(packed)
    )
    header = FrameHeader(
        sequence=sequence,
        exposure_ns=exposure_ns,
        intrinsics=Intrinsics(width=width, height=height, fx=fx, fy=fy, cx=cx, cy=cy),
        depth_unit_m=unit_m,
        sent_after_ns=sent_after * _SENT_AFTER_UNIT_NS,
    )
    plausible = 0 < width * height <= MAX_PIXELS and header.payload_bytes == length
    return header if version == VERSION and plausible else None


def encode_request(command: CameraCommand, rate_hz: float) -> bytes:
    """Return a request's bytes."""
    packed = _REQUEST.pack(REQUEST_MAGIC, VERSION, command, round(rate_hz * 10))
    return packed + CRC.pack(zlib.crc32(packed))


def decode_request(data: bytes) -> tuple[CameraCommand, float] | None:
    """Return command and rate in hertz, or None where the bytes are no valid request."""
    packed, (crc,) = data[: _REQUEST.size], CRC.unpack_from(data, _REQUEST.size)
    magic, version, command, decihertz = _REQUEST.unpack(packed)
    intact = zlib.crc32(packed) == crc and magic == REQUEST_MAGIC and version == VERSION
    if not intact or command not in tuple(CameraCommand):
        return None
    return CameraCommand(command), decihertz / 10.0
