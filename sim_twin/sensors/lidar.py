"""Emulate the LDROBOT LD19 at its serial line: 12-point packets while the head turns clockwise."""

import math
import struct
from collections import deque
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from drivers.clock import NS_PER_S
from drivers.lidar.base import BEAMS
from drivers.lidar.ld19 import HEADER, POINTS_PER_PACKET, STAMP_WRAP_MS, crc8

POINTS_PER_S = 4500
MIN_RANGE_M = 0.02
MAX_RANGE_M = 12.0
INTENSITY = 200
_NS_PER_MS = 1_000_000
_HEAD = struct.Struct("<2sHH")
_END = struct.Struct("<H")
_STAMP = struct.Struct("<H")
_POINT = np.dtype([("distance_mm", "<u2"), ("intensity", "u1")])


class LidarDevice:
    """Turn casts of the world into the LD19's packets.

    `cast` returns the ranges in metres of the beams it is given, beam i at i degrees
    counter-clockwise from the robot's front, 0 for no return. It is called `casts_per_turn` times a
    turn for the points up to the next cast, so that a moving robot distorts the scan as it does in
    life.
    """

    def __init__(
        self,
        cast: Callable[[NDArray[np.int64]], NDArray[np.float32]],
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
        self._next_cast_ns = 0
        self._start_ns: int | None = None
        self._sent_packets = 0
        self._bodies: deque[bytes] = deque()
        self._out = bytearray()

    def receive(self, data: bytes) -> None:
        """Ignore what the host sends: the LD19 only talks."""

    def transmit(self) -> bytes:
        """Return and forget the packets that are ready."""
        data = bytes(self._out)
        self._out.clear()
        return data

    def step(self, now_ns: int) -> None:
        """Send every packet whose last point is due by `now_ns`."""
        if self._start_ns is None:
            self._start_ns = self._next_cast_ns = now_ns
        if now_ns >= self._next_cast_ns:
            self._next_cast_ns += self._cast_every_ns
            self._measure(max(self._packets_due(self._next_cast_ns), self._packets_due(now_ns)))
        for _ in range(self._sent_packets, self._packets_due(now_ns)):
            stamp_ms = now_ns // _NS_PER_MS % STAMP_WRAP_MS
            packet = self._bodies.popleft() + _STAMP.pack(stamp_ms)
            self._out += packet + bytes((crc8(packet),))
            self._sent_packets += 1

    def _packets_due(self, now_ns: int) -> int:
        """Return how many packets have been measured to their last point by `now_ns`."""
        assert self._start_ns is not None
        return (now_ns - self._start_ns) * POINTS_PER_S // (NS_PER_S * POINTS_PER_PACKET)

    def _measure(self, end: int) -> None:
        """Look at the world once for all packets not sent yet, up to the one before `end`."""
        packets = np.arange(self._sent_packets, end)[:, None]
        points = packets * POINTS_PER_PACKET + np.arange(POINTS_PER_PACKET)
        angles_deg = np.multiply(points, self._step_deg, dtype=np.float64)
        readings = np.empty(points.shape, _POINT)
        readings["distance_mm"] = self._distances_mm(angles_deg)
        readings["intensity"] = np.where(readings["distance_mm"] > 0, INTENSITY, 0)
        hundredths = np.rint(angles_deg * 100.0).astype(np.int64) % 36_000
        edges = hundredths[:, [0, -1]].tolist()
        speed = round(self._speed_deg_s)
        self._bodies = deque(
            _HEAD.pack(HEADER, speed, first) + row.tobytes() + _END.pack(last)
            for (first, last), row in zip(edges, readings, strict=True)
        )

    def _distances_mm(self, angles_deg: NDArray[np.float64]) -> NDArray[np.float64]:
        beams = np.rint(self._mounting_deg - angles_deg).astype(np.int64) % BEAMS
        true_m = self._cast(beams.ravel()).reshape(beams.shape)
        noisy_m = true_m + self._sigma_m * self._random.standard_normal(true_m.shape)
        seen = (true_m >= MIN_RANGE_M) & (true_m <= MAX_RANGE_M)
        return np.where(seen, np.rint(noisy_m * 1000.0).clip(1.0, 65_535.0), 0.0)
