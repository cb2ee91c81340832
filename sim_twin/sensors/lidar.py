"""Emulate the LDROBOT LD19 at its serial line: 12-point packets while the head turns clockwise."""

import math
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
_MM_PER_M = 1000.0
_PACKETS_PER_S = POINTS_PER_S // POINTS_PER_PACKET
_POINT = np.dtype([("distance_mm", "<u2"), ("intensity", "u1")])
_PACKET = np.dtype(
    [
        ("header", "S2"),
        ("speed_deg_s", "<u2"),
        ("start", "<u2"),
        ("points", _POINT, (POINTS_PER_PACKET,)),
        ("end", "<u2"),
        ("stamp_ms", "<u2"),
        ("crc", "u1"),
    ]
)
_CHECKED_BYTES = _PACKET.itemsize - 1
_PLACES = np.arange(_CHECKED_BYTES)
_LAST_POINT = POINTS_PER_PACKET - 1


def _crc_parts() -> NDArray[np.uint8]:
    """Return what each value at each place adds to the CRC of a packet: the CRC is linear."""
    step = [crc8(bytes((value,))) for value in range(256)]
    parts = [step]
    for _ in range(_CHECKED_BYTES - 1):
        parts.insert(0, [step[value] for value in parts[0]])
    return np.array(parts, np.uint8)


_CRC_PARTS = _crc_parts()


class LidarDevice:
    """Turn casts of the world into the LD19's packets.

    `cast` returns the ranges in metres of the beams it is given, beam i at i degrees
    counter-clockwise from the robot's front, 0 for no return. It is called `casts_per_turn` times a
    turn for the points up to the next cast, so that a moving robot distorts the scan as it does in
    life, in steps of 33 ms. `rate_hz` and `range_ratio` (told over true range) may be changed at
    any time.
    """

    def __init__(
        self,
        cast: Callable[[NDArray[np.int64]], NDArray[np.float32]],
        rate_hz: float = 10.0,
        *,
        sigma_m: float = 0.005,
        seed: int = 0,
        mounting_yaw_rad: float = 0.0,
        casts_per_turn: int = 3,
    ) -> None:
        self.rate_hz = rate_hz
        self.range_ratio = 1.0
        self._cast = cast
        self._step_deg = rate_hz * 360.0 / POINTS_PER_S
        self._phase_deg = 0.0
        self._sigma_m = sigma_m
        self._random = np.random.default_rng(seed)
        self._mounting_deg = math.degrees(mounting_yaw_rad)
        self._cast_every_ns = round(NS_PER_S / rate_hz / casts_per_turn)
        self._next_cast_ns = 0
        self._start_ns = 0
        self._started = False
        self._sent_packets = 0
        self._due_ns: deque[int] = deque()
        self._packets = b""
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
        if not self._started:
            self._started = True
            self._start_ns = self._next_cast_ns = now_ns
        if now_ns >= self._next_cast_ns:
            self._next_cast_ns += self._cast_every_ns
            end = max(self._packets_due(self._next_cast_ns), self._packets_due(now_ns))
            if end > self._sent_packets:
                self._measure(end)
        while self._due_ns and self._due_ns[0] <= now_ns:
            self._send()

    def _send(self) -> None:
        self._due_ns.popleft()
        self._sent_packets += 1
        self._out += self._packets[: _PACKET.itemsize]
        self._packets = self._packets[_PACKET.itemsize :]

    def _packets_due(self, now_ns: int) -> int:
        """Return how many packets have been measured to their last point by `now_ns`."""
        return (now_ns - self._start_ns) * _PACKETS_PER_S // NS_PER_S

    def _measure(self, end: int) -> None:
        """Look at the world once for all packets not sent yet, up to the one before `end`.

        A packet's stamp is when its last point was measured, whenever the host reads it.
        """
        self._follow_rate()
        first, count = self._sent_packets, end - self._sent_packets
        points = np.arange(first * POINTS_PER_PACKET, end * POINTS_PER_PACKET, dtype=np.float64)
        angles_deg = points.reshape(count, POINTS_PER_PACKET) * self._step_deg + self._phase_deg
        hundredths = np.rint(angles_deg[:, ::_LAST_POINT] * 100.0) % 36_000.0
        numbers = range(first + 1, end + 1)
        due_ns = [self._start_ns - number * -NS_PER_S // _PACKETS_PER_S for number in numbers]
        packets = np.empty(count, _PACKET)
        packets["header"] = HEADER
        packets["speed_deg_s"] = round(self.rate_hz * 360.0)
        packets["start"], packets["end"] = hundredths.T
        distances_mm, seen = self._look(angles_deg)
        packets["points"]["distance_mm"] = distances_mm
        packets["points"]["intensity"] = seen * INTENSITY
        packets["stamp_ms"] = [due // _NS_PER_MS % STAMP_WRAP_MS for due in due_ns]
        checked = packets.view(np.uint8).reshape(count, _PACKET.itemsize)[:, :_CHECKED_BYTES]
        packets["crc"] = np.bitwise_xor.reduce(_CRC_PARTS[_PLACES, checked], axis=1)
        self._due_ns = deque(due_ns)
        self._packets = packets.tobytes()

    def _follow_rate(self) -> None:
        """Turn on from where the head is at another speed."""
        step_deg = self.rate_hz * 360.0 / POINTS_PER_S
        first = self._sent_packets * POINTS_PER_PACKET
        self._phase_deg += first * (self._step_deg - step_deg)
        self._step_deg = step_deg

    def _look(
        self, angles_deg: NDArray[np.float64]
    ) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
        """Return distances in millimetres, 0 where nothing is in range, and where something is."""
        beams = np.rint(self._mounting_deg - angles_deg).astype(np.int64)
        first, last = beams[-1, -1], beams[0, 0]
        true_m = self._cast(np.arange(first, last + 1) % BEAMS)[beams - first]
        told_mm = self._random.standard_normal(beams.shape)
        told_mm *= self._sigma_m * _MM_PER_M
        told_mm += true_m * (self.range_ratio * _MM_PER_M)
        seen = (true_m >= MIN_RANGE_M) & (true_m <= MAX_RANGE_M)
        return np.rint(told_mm).clip(1.0, 65_535.0) * seen, seen
