"""Drive the CEVA BNO085 inertial sensor in UART-RVC mode (115200 baud, 8N1, 100 frames a second).

Protocol: CEVA, "BNO08X Data Sheet" 1000-3927, section 1.3.5.2. Frames of 19 bytes:

    offset  size  meaning, little-endian
    0       2     header 0xAAAA
    2       1     index, counts up and wraps at 256
    3       6     yaw, pitch, roll, each a signed 0.01 degree
    9       6     acceleration x, y, z, each a signed 0.001 g (it includes gravity)
    15      3     reserved, 0
    18      1     sum of bytes 2..17, modulo 256

Yaw counts from the reset, not from north, positive counter-clockwise about the sensor's z axis.
"""

import math
import struct

from drivers.base import ByteTransport
from drivers.clock import NS_PER_S, Clock
from drivers.framing import align
from drivers.imu.base import ImuCounters, ImuSample

HEADER = b"\xaa\xaa"
FRAME_BYTES = 19
FRAME_PERIOD_NS = NS_PER_S // 100
STANDARD_GRAVITY_M_S2 = 9.80665
_CENTIDEGREE_RAD = math.radians(0.01)
_MILLI_G_M_S2 = STANDARD_GRAVITY_M_S2 * 1e-3
_READ_BYTES = 4096
_BODY = struct.Struct("<B6h3x")


class Bno085Rvc:
    """Read inertial samples as they arrive."""

    def __init__(self, transport: ByteTransport, clock: Clock) -> None:
        self.counters = ImuCounters()
        self._transport = transport
        self._clock = clock
        self._buffer = bytearray()
        self._last_index: int | None = None

    def poll(self) -> list[ImuSample]:
        """Return the samples that arrived since the last call, oldest first; never waits.

        Raises:
            LinkLost: the serial line has gone.
        """
        while chunk := self._transport.read(_READ_BYTES, 0):
            self._buffer += chunk
        now_ns = self._clock.now_ns()
        bodies = self._bodies()
        newest = len(bodies) - 1
        # A frame has no stamp: the newest has just arrived, the others one period before it each.
        return [
            _sample(body, now_ns - (newest - at) * FRAME_PERIOD_NS)
            for at, body in enumerate(bodies)
        ]

    def close(self) -> None:
        """Release the line."""
        self._transport.close()

    def _bodies(self) -> list[bytes]:
        bodies: list[bytes] = []
        while self._seek_header() and len(self._buffer) >= FRAME_BYTES:
            body, checksum = bytes(self._buffer[2 : FRAME_BYTES - 1]), self._buffer[FRAME_BYTES - 1]
            if sum(body) & 0xFF != checksum:
                self.counters.checksum_errors += 1
                self._discard(1)
                continue
            del self._buffer[:FRAME_BYTES]
            if self._is_new(body[0]):
                bodies.append(body)
        return bodies

    def _is_new(self, index: int) -> bool:
        """Count a frame; one with the last one's index is a stuck sensor's and tells nothing."""
        self.counters.frames += 1
        if index == self._last_index:
            self.counters.repeated_frames += 1
            return False
        if self._last_index is not None:
            self.counters.lost_frames += (index - self._last_index - 1) % 256
        self._last_index = index
        return True

    def _seek_header(self) -> bool:
        """Drop bytes up to the next header; false when there is none yet."""
        found, dropped = align(self._buffer, HEADER)
        self.counters.discarded_bytes += dropped
        return found

    def _discard(self, count: int) -> None:
        self.counters.discarded_bytes += count
        del self._buffer[:count]


def _sample(body: bytes, stamp_ns: int) -> ImuSample:
    index, yaw, pitch, roll, *acceleration = _BODY.unpack(body)
    x, y, z = (value * _MILLI_G_M_S2 for value in acceleration)
    return ImuSample(
        stamp_ns=stamp_ns,
        index=index,
        yaw_rad=yaw * _CENTIDEGREE_RAD,
        pitch_rad=pitch * _CENTIDEGREE_RAD,
        roll_rad=roll * _CENTIDEGREE_RAD,
        acceleration_m_s2=(x, y, z),
    )
