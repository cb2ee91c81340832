"""Drive the LDROBOT LD19, a 360 degree planar lidar on a one-way serial line (230400 baud, 8N1).

Protocol: LDROBOT, "LD19 Development Manual" V2.3, sections 3 and 4. Packets of 47 bytes:

    offset  size  meaning, little-endian
    0       1     header 0x54
    1       1     0x2C: packet type 1, 12 points
    2       2     speed, degrees per second
    4       2     start angle, 0.01 degree
    6       36    12 points: distance in mm (2 bytes), intensity (1 byte); distance 0 is no return
    42      2     end angle, 0.01 degree
    44      2     time stamp in ms, wraps at 30000
    46      1     CRC-8, polynomial 0x4D, start value 0

Angles grow clockwise seen from above. The driver turns them into beams counter-clockwise from the
robot's front.
"""

import math
import struct
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from drivers.base import ByteTransport
from drivers.clock import NS_PER_S, Clock
from drivers.device_clock import DeviceClock
from drivers.framing import align
from drivers.lidar.base import BEAMS, LidarCounters, Scan

HEADER = b"\x54\x2c"
PACKET_BYTES = 47
POINTS_PER_PACKET = 12
STAMP_WRAP_MS = 30_000
MAX_STEP_DEG = 3.0
MIN_COVERAGE_DEG = 300.0
MAX_GAP_DEG = 180.0
_NS_PER_MS = 1_000_000
_READ_BYTES = 16_384
_MAX_PIECES = 1024
_FRAME = struct.Struct("<2sHH36sHHB")
_POINT_NUMBERS = np.arange(POINTS_PER_PACKET, dtype=np.float64)
_POINT = np.dtype([("distance_mm", "<u2"), ("intensity", "u1")])


def _crc_table() -> bytes:
    table = bytearray(256)
    for value in range(256):
        crc = value
        for _ in range(8):
            crc = ((crc << 1) ^ 0x4D if crc & 0x80 else crc << 1) & 0xFF
        table[value] = crc
    return bytes(table)


_CRC_TABLE = _crc_table()


def crc8(data: bytes) -> int:
    """Return the vendor's CRC-8 of `data`."""
    crc = 0
    for byte in data:
        crc = _CRC_TABLE[crc ^ byte]
    return crc


@dataclass(frozen=True, slots=True)
class _Packet:
    speed_deg_s: int
    start_deg: float
    step_deg: float
    stamp_ms: int
    distance_mm: NDArray[np.uint16]


@dataclass(frozen=True, slots=True)
class _Piece:
    angles_deg: NDArray[np.float64]
    distance_mm: NDArray[np.uint16]
    stamp_ns: int


class Ld19:
    """Assemble LD19 packets into whole scans; `mounting_yaw_rad` is where sensor zero points."""

    def __init__(
        self, transport: ByteTransport, clock: Clock, *, mounting_yaw_rad: float = 0.0
    ) -> None:
        self.counters = LidarCounters()
        self._transport = transport
        self._clock = clock
        self._mounting_deg = math.degrees(mounting_yaw_rad)
        self._buffer = bytearray()
        self._device_clock = DeviceClock(wrap_ns=STAMP_WRAP_MS * _NS_PER_MS)
        self._last_deg: float | None = None
        self._last_stamp_ns = 0
        self._synced = False
        self._begin_scan()

    def poll(self) -> Scan | None:
        """Return the newest scan completed since the last call, or None; never waits.

        Raises:
            LinkLost: the serial line has gone.
        """
        while chunk := self._transport.read(_READ_BYTES, 0):
            self._buffer += chunk
        newest = None
        while (packet := self._next_packet()) is not None:
            newest = self._take(packet) or newest
        return newest

    def close(self) -> None:
        """Release the line."""
        self._transport.close()

    def _next_packet(self) -> _Packet | None:
        """Cut the next intact packet from the buffer; skip what is not one."""
        while self._seek_header() and len(self._buffer) >= PACKET_BYTES:
            raw = bytes(self._buffer[:PACKET_BYTES])
            if crc8(raw[:-1]) != raw[-1]:
                self.counters.crc_errors += 1
                self._discard(1)
                continue
            del self._buffer[:PACKET_BYTES]
            self.counters.packets += 1
            if (packet := _decode(raw)) is not None:
                return packet
            self.counters.discarded_bytes += PACKET_BYTES
        return None

    def _seek_header(self) -> bool:
        """Drop bytes up to the next header; false when there is none yet."""
        found, dropped = align(self._buffer, HEADER)
        self.counters.discarded_bytes += dropped
        return found

    def _discard(self, count: int) -> None:
        self.counters.discarded_bytes += count
        del self._buffer[:count]

    def _take(self, packet: _Packet) -> Scan | None:
        """Add a packet's points to the scan; return the scan that it completes."""
        stamp_ns = self._device_clock.to_host_ns(packet.stamp_ms * _NS_PER_MS, self._clock.now_ns())
        wrapped: NDArray[np.float64] = (packet.start_deg + packet.step_deg * _POINT_NUMBERS) % 360.0
        first_deg, last_deg = float(wrapped[0]), float(wrapped[-1])
        self._forget_before_gap(stamp_ns, packet.speed_deg_s)
        goes_on = first_deg - (self._last_deg or 0.0) >= -180.0 and last_deg >= first_deg
        before_deg, self._last_deg = self._last_deg, last_deg
        if goes_on:
            self._add(packet, wrapped, slice(None), stamp_ns)
            return None
        start = int(np.argmax(np.diff(wrapped, prepend=before_deg or 0.0) < -180.0))
        self._add(packet, wrapped, slice(0, start), stamp_ns)
        scan = self._finish(packet.speed_deg_s)
        self._add(packet, wrapped, slice(start, None), stamp_ns)
        return scan

    def _forget_before_gap(self, stamp_ns: int, speed_deg_s: int) -> None:
        """Begin anew where half a turn or more is missing: its two sides are of different turns."""
        gap_ns, self._last_stamp_ns = stamp_ns - self._last_stamp_ns, stamp_ns
        if self._pieces and gap_ns * speed_deg_s > MAX_GAP_DEG * NS_PER_S:
            self.counters.incomplete_scans += 1
            self._begin_scan()

    def _add(
        self, packet: _Packet, angles_deg: NDArray[np.float64], part: slice, stamp_ns: int
    ) -> None:
        distance_mm = packet.distance_mm[part]
        self._pieces.append(_Piece(angles_deg[part], distance_mm, stamp_ns))
        self._coverage_deg += packet.step_deg * distance_mm.size

    def _begin_scan(self) -> None:
        # A head that is stuck never ends its turn; only the newest of what it says counts.
        self._pieces: deque[_Piece] = deque(maxlen=_MAX_PIECES)
        self._coverage_deg = 0.0

    def _finish(self, speed_deg_s: int) -> Scan | None:
        pieces, coverage_deg = self._pieces, self._coverage_deg
        was_synced, self._synced = self._synced, True
        self._begin_scan()
        if coverage_deg < MIN_COVERAGE_DEG:
            # The first turn after the start is partial by nature and not worth an alarm.
            self.counters.incomplete_scans += was_synced
            return None
        self.counters.scans += 1
        ranges_m, stamps = self._merge(pieces)
        stamp_ns = int(stamps.max())
        return Scan(
            stamp_ns=stamp_ns,
            range_m=np.where(np.isinf(ranges_m), np.float32(0.0), ranges_m),
            beam_stamp_ns=np.where(stamps > 0, stamps, stamp_ns),
            turn_hz=speed_deg_s / 360.0,
        )

    def _merge(self, pieces: Sequence[_Piece]) -> tuple[NDArray[np.float32], NDArray[np.int64]]:
        """Return range, infinite without return, and stamp of each beam, 0 where none looked."""
        angles_deg = np.concatenate([piece.angles_deg for piece in pieces])
        distance_mm = np.concatenate([piece.distance_mm for piece in pieces])
        beams = np.rint(self._mounting_deg - angles_deg).astype(np.int64) % BEAMS
        stamps = np.zeros(BEAMS, dtype=np.int64)
        sizes = [piece.distance_mm.size for piece in pieces]
        stamps[beams] = np.repeat([piece.stamp_ns for piece in pieces], sizes)
        ranges_m = np.full(BEAMS, np.inf, dtype=np.float32)
        seen = distance_mm > 0
        # Two points may fall on one beam: the nearer one is what the robot could hit.
        np.minimum.at(ranges_m, beams[seen], (distance_mm[seen] / 1000.0).astype(np.float32))
        return ranges_m, stamps


def _decode(raw: bytes) -> _Packet | None:
    """Return the packet's content, or None where its angles cannot belong to a turning lidar."""
    _, speed_deg_s, start, points, end, stamp_ms, _ = _FRAME.unpack(raw)
    span_deg = ((end - start) % 36_000) / 100.0
    step_deg = span_deg / (POINTS_PER_PACKET - 1)
    if start >= 36_000 or end >= 36_000 or step_deg > MAX_STEP_DEG or stamp_ms > STAMP_WRAP_MS:
        return None
    return _Packet(
        speed_deg_s=speed_deg_s,
        start_deg=start / 100.0,
        step_deg=step_deg,
        stamp_ms=stamp_ms,
        distance_mm=np.frombuffer(points, dtype=_POINT)["distance_mm"],
    )
