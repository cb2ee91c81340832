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
_TURN_CENTIDEG = 36_000
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
_PLACES = np.arange(_CHECKED_BYTES) * 256
_LAST_POINT = POINTS_PER_PACKET - 1
_NOISY_POINTS = POINTS_PER_S
_MOST_BEHIND_NS = NS_PER_S // 5
"""A line keeps no more than that; to make up for a long halt at once would be another one."""


def _crc_parts() -> NDArray[np.uint8]:
    """Return what each value at each place adds to the CRC of a packet: the CRC is linear."""
    step = [crc8(bytes((value,))) for value in range(256)]
    parts = [step]
    for _ in range(_CHECKED_BYTES - 1):
        parts.insert(0, [step[value] for value in parts[0]])
    return np.array(parts, np.uint8)


_CRC_PARTS = _crc_parts().ravel()


class PacketBlock:
    """Hold the memory of some packets, and their fields as arrays; what never changes is filled in.

    Finding the fields of a packed record costs more than writing them.
    """

    def __init__(self, count: int) -> None:
        packets = np.zeros(count, _PACKET)
        packets["header"] = HEADER
        points = packets["points"]
        self._memory = packets
        self._checked = packets.view(np.uint8).reshape(count, _PACKET.itemsize)[:, :_CHECKED_BYTES]
        self._crc = packets["crc"]
        self._crc_places = np.empty((count, _CHECKED_BYTES), np.intp)
        self._crc_parts = np.empty((count, _CHECKED_BYTES), np.uint8)
        self.speed_deg_s = packets["speed_deg_s"]
        self.start = packets["start"]
        self.end = packets["end"]
        self.stamp_ms = packets["stamp_ms"]
        self.distance_mm = points["distance_mm"]
        self.intensity = points["intensity"]

    def to_bytes(self) -> bytes:
        """Return the packets as they go over the line."""
        np.add(self._checked, _PLACES, self._crc_places)
        _CRC_PARTS.take(self._crc_places, None, self._crc_parts, "clip")
        np.bitwise_xor.reduce(self._crc_parts, axis=1, out=self._crc)
        return self._memory.tobytes()


class LidarDevice:
    """Turn casts of the world into the LD19's packets.

    `cast` returns the ranges in metres of a run of beams, beam i at i degrees counter-clockwise
    from the robot's front (360 is the front again), 0 for no return. It is called `casts_per_turn`
    times a turn for the points up to the next cast, so that a moving robot distorts the scan as it
    does in life, in steps of 33 ms. `rate_hz` and `range_ratio` (told over true range) may be
    changed at any time.
    """

    def __init__(
        self,
        cast: Callable[[range], NDArray[np.float32]],
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
        self._sigma_mm = sigma_m * _MM_PER_M
        self._random = np.random.default_rng(seed)
        self._noise_mm = np.empty(0)
        self._turned_deg = np.empty(0)
        self._mounting_deg = math.degrees(mounting_yaw_rad)
        self._cast_every_ns = round(NS_PER_S / rate_hz / casts_per_turn)
        self._start_ns = 0
        self._started = False
        self._sent_packets = 0
        self._waiting: deque[tuple[int, bytes]] = deque()
        self._blocks: dict[int, PacketBlock] = {}
        self._out = bytearray()
        self.due_ns = 0

    def receive(self, data: bytes) -> None:
        """Ignore what the host sends: the LD19 only talks."""

    def transmit(self) -> bytes:
        """Return and forget the packets that are ready."""
        data = bytes(self._out)
        self._out.clear()
        return data

    def step(self, now_ns: int) -> None:
        """Send every packet whose last point is due by `now_ns`, and cast at `due_ns`."""
        if not self._started:
            self._started = True
            self._start_ns = self.due_ns = now_ns
        self._send(now_ns)
        if now_ns >= self.due_ns:
            # What nobody has looked for in time is left out: the head has turned on meanwhile.
            missed = self._packets_due(now_ns - _MOST_BEHIND_NS)
            self._sent_packets = max(self._sent_packets, missed)
            self.due_ns = max(self.due_ns + self._cast_every_ns, now_ns)
            end = self._packets_due(self.due_ns)
            if end > self._sent_packets:
                self._measure(end)
            self._send(now_ns)

    def _send(self, now_ns: int) -> None:
        waiting = self._waiting
        while waiting and waiting[0][0] <= now_ns:
            self._out += waiting.popleft()[1]
            self._sent_packets += 1

    def _packets_due(self, now_ns: int) -> int:
        """Return how many packets have been measured to their last point by `now_ns`."""
        return (now_ns - self._start_ns) * _PACKETS_PER_S // NS_PER_S

    def _measure(self, end: int) -> None:
        """Look at the world once for all packets not sent yet, up to the one before `end`.

        A packet's stamp is when its last point was measured, whenever the host reads it.
        """
        self._follow_rate()
        first, step_deg, phase_deg = self._sent_packets, self._step_deg, self._phase_deg
        packet_deg = POINTS_PER_PACKET * step_deg
        numbers = range(first, end)
        block = self._block(end - first)
        # When the last point of each is measured, rounded up.
        due_ns = [self._start_ns - (number + 1) * NS_PER_S // -_PACKETS_PER_S for number in numbers]
        # Lists, as a dozen of packets is too few for array operations to pay.
        starts = [number * (100.0 * packet_deg) + 100.0 * phase_deg for number in numbers]
        sweep = 100.0 * _LAST_POINT * step_deg
        block.speed_deg_s.fill(round(self.rate_hz * 360.0))
        block.start[:] = [round(start) % _TURN_CENTIDEG for start in starts]
        block.end[:] = [round(start + sweep) % _TURN_CENTIDEG for start in starts]
        block.stamp_ms[:] = [due // _NS_PER_MS % STAMP_WRAP_MS for due in due_ns]
        self._look(first * packet_deg + phase_deg, block)
        data, size = block.to_bytes(), _PACKET.itemsize
        packets = [data[start : start + size] for start in range(0, len(data), size)]
        self._waiting = deque(zip(due_ns, packets, strict=True))

    def _block(self, count: int) -> PacketBlock:
        if count not in self._blocks:
            self._blocks[count] = PacketBlock(count)
        return self._blocks[count]

    def _follow_rate(self) -> None:
        """Turn on from where the head is at another speed."""
        step_deg = self.rate_hz * 360.0 / POINTS_PER_S
        first = self._sent_packets * POINTS_PER_PACKET
        self._phase_deg += first * (self._step_deg - step_deg)
        if step_deg != self._step_deg:
            self._step_deg = step_deg
            self._turned_deg = np.empty(0)

    def _look(self, start_deg: float, block: PacketBlock) -> None:
        """Measure distances: 0 where nothing is in range, at least a millimetre elsewhere."""
        count = block.distance_mm.size
        beams = self._beams(self._mounting_deg - start_deg, count)
        first, last = int(beams[-1]), int(beams[0])
        run = range(first, last + 1) if last - first < BEAMS else range(first, first + BEAMS)
        beams -= first
        true_m = self._cast(run).take(beams, mode="wrap")
        told_mm = self._next_noise_mm(count)
        told_mm += true_m * (self.range_ratio * _MM_PER_M)
        np.rint(told_mm, out=told_mm)
        np.maximum(told_mm, 1.0, out=told_mm)
        np.minimum(told_mm, 65_535.0, out=told_mm)
        seen = true_m >= MIN_RANGE_M
        seen &= true_m <= MAX_RANGE_M
        told_mm *= seen
        block.distance_mm[:] = told_mm.reshape(block.distance_mm.shape)
        seen = seen.reshape(block.intensity.shape)
        np.multiply(seen, INTENSITY, out=block.intensity, casting="unsafe")

    def _beams(self, start_deg: float, count: int) -> NDArray[np.intp]:
        """Return the beams that `count` points look along, clockwise from an angle."""
        if count > self._turned_deg.size:
            self._turned_deg = np.arange(count, dtype=np.float64) * -self._step_deg
        angles_deg = self._turned_deg[:count] + start_deg
        np.rint(angles_deg, angles_deg)
        return angles_deg.astype(np.intp)

    def _next_noise_mm(self, count: int) -> NDArray[np.float64]:
        """Return the errors of the next points; drawing many at once costs less."""
        if self._noise_mm.size < count:
            fresh = self._random.standard_normal(max(_NOISY_POINTS, count))
            self._noise_mm = fresh * self._sigma_mm
        noise_mm, self._noise_mm = self._noise_mm[:count], self._noise_mm[count:]
        return noise_mm
