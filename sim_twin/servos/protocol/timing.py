"""Let replies take their time: baud rate, return delay, jitter, and the adapter's latency timer.

A USB adapter of the FTDI kind passes bytes on when its buffer is full or its timer runs out; the
timer starts anew with every delivery. A plain UART, which has none, passes on what its FIFO holds:
a reply when its last byte is there, and a long one in pieces meanwhile.

Source: FTDI application note AN232B-04 (62 data bytes per packet, a timer of 16 ms as delivered).
"""

import heapq
from collections.abc import Sequence
from dataclasses import dataclass
from random import Random
from typing import Final, NamedTuple

from drivers.clock import NS_PER_S

BITS_PER_BYTE: Final = 10
ADAPTER_BYTES: Final = 62
FIFO_BYTES: Final = 32


@dataclass(frozen=True, slots=True, kw_only=True)
class WireTiming:
    """Choose how slow the bus is; the return delay is each servo's own register.

    Raises:
        ValueError: a number is out of its range.
    """

    baud: int
    latency_timer_s: float = 0.0
    jitter_s: float = 0.0
    seed: int = 0

    def __post_init__(self) -> None:
        if self.baud <= 0:
            raise ValueError(f"wire timing: baud: expected a positive number, got {self.baud}")
        for name in ("latency_timer_s", "jitter_s"):
            if getattr(self, name) < 0.0:
                raise ValueError(f"wire timing: {name}: expected >= 0, got {getattr(self, name)}")


class Reply(NamedTuple):
    """Hold what one servo says, and what it waits before; a fault makes it late beyond that."""

    data: bytes
    return_delay_ns: int = 0
    late_ns: int = 0


class _AdapterBuffer:
    """Collect bytes until the buffer is full or the latency timer has run out."""

    def __init__(self, timer_ns: int) -> None:
        self._timer_ns = timer_ns
        self._held = bytearray()
        self._delivered_ns = 0
        self._newest_ns = 0
        self.due_ns = 0

    def __len__(self) -> int:
        return len(self._held)

    def take(self, start_ns: int, byte_ns: float, data: bytes) -> list[tuple[int, bytes]]:
        """Take bytes that arrive from `start_ns` on; return what they push out, and when."""
        pushed = []
        for count, byte in enumerate(data, start=1):
            self._newest_ns = max(self._newest_ns, start_ns + round(count * byte_ns))
            if self._held and self._newest_ns > self.due_ns:
                pushed.append((self.due_ns, self.flush()))
            if not self._held:
                periods = -(-(self._newest_ns - self._delivered_ns) // self._timer_ns)
                self.due_ns = self._delivered_ns + periods * self._timer_ns
            self._held.append(byte)
            if len(self._held) == ADAPTER_BYTES:
                self.due_ns = self._newest_ns
                pushed.append((self.due_ns, self.flush()))
        return pushed

    def flush(self) -> bytes:
        """Deliver what is held."""
        self._delivered_ns = self.due_ns
        data = bytes(self._held)
        self._held.clear()
        return data


class ReplyQueue:
    """Hold what the servos say until the host has it."""

    def __init__(self, timing: WireTiming | None) -> None:
        self.paced = timing is not None
        self._byte_ns = 0.0
        self._jitter_ns = 0.0
        self._random = Random(0)
        self._adapter: _AdapterBuffer | None = None
        self._free_ns = 0
        self._now: list[bytes] = []
        self._later: list[tuple[int, int, bytes]] = []
        self._count = 0
        if timing is not None:
            self.set_baud(timing.baud)
            self._jitter_ns = timing.jitter_s * NS_PER_S
            self._random = Random(f"{timing.seed} jitter")
            if timing.latency_timer_s:
                self._adapter = _AdapterBuffer(round(timing.latency_timer_s * NS_PER_S))

    def set_baud(self, baud: int) -> None:
        """Take bytes at another rate from now on; nothing changes where the bus is not paced."""
        if self.paced:
            self._byte_ns = BITS_PER_BYTE * NS_PER_S / baud

    def hear(self, data: bytes, now_ns: int, *, echo: bool = False) -> None:
        """Let the host's bytes occupy the bus; with `echo` the adapter hears them too."""
        start_ns = max(now_ns, self._free_ns)
        self._free_ns = start_ns + round(len(data) * self._byte_ns)
        if echo:
            self._deliver(start_ns, data, now_ns)

    def say(self, replies: Sequence[Reply], now_ns: int) -> None:
        """Let servos answer one after the other."""
        if not self.paced:
            for reply in replies:
                self._deliver(now_ns + reply.late_ns, reply.data, now_ns)
            return
        for reply in replies:
            start_ns = self._free_ns + reply.return_delay_ns + self._jitter()
            self._deliver(start_ns + reply.late_ns, reply.data, now_ns)
            self._free_ns = start_ns + round(len(reply.data) * self._byte_ns)

    def ready(self, now_ns: int) -> bytes:
        """Return and forget what has arrived at the host."""
        ready, self._now = self._now, []
        while self._later and self._later[0][0] <= now_ns:
            ready.append(heapq.heappop(self._later)[2])
        if self._adapter and self._adapter.due_ns <= now_ns:
            ready.append(self._adapter.flush())
        return b"".join(ready)

    def next_due_ns(self) -> int | None:
        """Return when the next bytes arrive at the host; 0 when they are there."""
        if self._now:
            return 0
        due = [self._later[0][0]] if self._later else []
        if self._adapter:
            due.append(self._adapter.due_ns)
        return min(due, default=None)

    def _jitter(self) -> int:
        return round(self._random.random() * self._jitter_ns) if self._jitter_ns else 0

    def _deliver(self, start_ns: int, data: bytes, now_ns: int) -> None:
        if self._adapter is not None:
            for due_ns, chunk in self._adapter.take(start_ns, self._byte_ns, data):
                self._push(due_ns, chunk)
            return
        if start_ns <= now_ns and not self.paced:
            self._now.append(data)
            return
        for start in range(0, len(data), FIFO_BYTES):
            piece = data[start : start + FIFO_BYTES]
            self._push(start_ns + round((start + len(piece)) * self._byte_ns), piece)

    def _push(self, due_ns: int, data: bytes) -> None:
        self._count += 1
        heapq.heappush(self._later, (due_ns, self._count, data))
