"""Emulate the LDROBOT LD19 at its serial line: 12-point packets while the head turns clockwise."""

import math
import struct
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from drivers.clock import NS_PER_S
from drivers.lidar.ld19 import BEAMS, HEADER, POINTS_PER_PACKET, STAMP_WRAP_MS, crc8

POINTS_PER_S = 4500
MIN_RANGE_M = 0.02
MAX_RANGE_M = 12.0
INTENSITY = 200
_NS_PER_MS = 1_000_000
_HEAD = struct.Struct("<2sHH")
_TAIL = struct.Struct("<HH")


class LidarDevice:
    """Turn casts of the world into the LD19's packets.

    `cast` returns 360 ranges in metres, beam i at i degrees counter-clockwise from the robot's
    front, 0 for no return. It is called `casts_per_turn` times a turn, so that a moving robot
    distorts the scan as it does in life.
    """

    def __init__(
        self,
        cast: Callable[[], NDArray[np.float32]],
        rate_hz: float = 10.0,
        *,
        sigma_m: float = 0.005,
        seed: int = 0,
        mounting_yaw_rad: float = 0.0,
        casts_per_turn: int = 5,
    ) -> None:
        self._cast = cast
        self._speed_deg_s = rate_hz * 360.0
        self._step_deg = self._speed_deg_s / POINTS_PER_S
        self._sigma_m = sigma_m
        self._random = np.random.default_rng(seed)
        self._mounting_deg = math.degrees(mounting_yaw_rad)
        self._cast_every_ns = round(NS_PER_S / rate_hz / casts_per_turn)
        self._ranges_m = np.zeros(BEAMS, dtype=np.float32)
        self._next_cast_ns = 0
        self._start_ns: int | None = None
        self._sent_packets = 0
        self._out = bytearray()

    def receive(self, data: bytes) -> None:
        """Ignore what the host sends: the LD19 only talks."""

    def transmit(self) -> bytes:
        """Return and forget the packets that are ready."""
        data = bytes(self._out)
        self._out.clear()
        return data

    def step(self, now_ns: int) -> None:
        """Measure every packet whose last point is due by `now_ns`."""
        if self._start_ns is None:
            self._start_ns = self._next_cast_ns = now_ns
        if now_ns >= self._next_cast_ns:
            self._ranges_m = np.asarray(self._cast(), dtype=np.float32)
            self._next_cast_ns += self._cast_every_ns
        points = (now_ns - self._start_ns) * POINTS_PER_S // NS_PER_S
        while (self._sent_packets + 1) * POINTS_PER_PACKET <= points:
            self._out += self._packet(now_ns)
            self._sent_packets += 1

    def _packet(self, now_ns: int) -> bytes:
        first = self._sent_packets * POINTS_PER_PACKET
        angles_deg = np.arange(first, first + POINTS_PER_PACKET, dtype=np.float64) * self._step_deg
        points = b"".join(
            struct.pack("<HB", distance, INTENSITY if distance else 0)
            for distance in self._measure_mm(angles_deg)
        )
        start, end = (round(a * 100) % 36_000 for a in (angles_deg[0], angles_deg[-1]))
        stamp_ms = now_ns // _NS_PER_MS % STAMP_WRAP_MS
        body = _HEAD.pack(HEADER, round(self._speed_deg_s), start) + points
        body += _TAIL.pack(end, stamp_ms)
        return body + bytes([crc8(body)])

    def _measure_mm(self, angles_deg: NDArray[np.float64]) -> list[int]:
        beams = np.rint(self._mounting_deg - angles_deg).astype(np.int64) % BEAMS
        true_m = self._ranges_m[beams]
        noisy_m = true_m + self._sigma_m * self._random.standard_normal(true_m.size)
        seen = (true_m >= MIN_RANGE_M) & (true_m <= MAX_RANGE_M)
        return [int(v) for v in np.where(seen, np.rint(noisy_m * 1000.0).clip(1.0, 65_535.0), 0.0)]
