"""Wait for a fast sync read's reply: one packet to which each servo adds its part."""

from typing import Final

from drivers.base import ByteTransport
from drivers.clock import Clock
from drivers.dynamixel.wire.sync_read import STATUS_OVERHEAD_BYTES, SyncRead
from drivers.servo.counters import BusCounters
from drivers.servo.wire import Wire

_STALL_PERCENT: Final = 60
"""How much of the margin the next part of a chained reply may be late."""
_LESSONS: Final = 8
"""From how many chained replies it is learned what is in time."""


class ChainedWire(Wire):
    """Learn how late the parts of a chained reply come, and give up where it has stopped."""

    def __init__(
        self, transport: ByteTransport, clock: Clock, baud: int, counters: BusCounters
    ) -> None:
        super().__init__(transport, clock, baud, counters)
        self._lateness_ns: int | None = None
        self._lessons = _LESSONS

    def wire_ns(self, read: SyncRead) -> int:
        """Return how long a sync read takes if nothing is late."""
        return (len(read.request) + read.reply_bytes) * self.ns_per_byte

    def receive_chained(self, read: SyncRead, deadline_ns: int, margin_ns: int) -> bytes:
        """Return what came of a fast sync read's reply; give up early where it has stopped.

        The reply is one packet to which each servo adds its part. When the next part does not
        begin in time, nothing more will come. What is in time must be learned first: some adapters
        and UARTs hold back a reply until it is over.

        Raises:
            LinkLost: the adapter is gone.
        """
        count = read.reply_bytes
        stall_ns = self._stall_ns(read, 0, deadline_ns, margin_ns)
        if self._burst is None or self._lessons:
            data = self.receive(count, stall_ns)
            self._learn_lateness(read, data)
        else:
            data = self.receive_all(count, stall_ns)
        while data and len(data) < count:
            limit_ns = self._stall_ns(read, len(data), deadline_ns, margin_ns)
            more = self.receive_all(count - len(data), limit_ns)
            if not more:
                break
            data += more
        self._answered = bool(data)
        return data

    def _learn_lateness(self, read: SyncRead, data: bytes) -> None:
        if data and self._lessons:
            self._lessons -= 1
            late_ns = self._clock.now_ns() - self._part_ns(read, 0)
            self._lateness_ns = max(self._lateness_ns or 0, late_ns)

    def _part_ns(self, read: SyncRead, arrived: int) -> int:
        """Return when the next part of a chained reply is over on the wire."""
        wire_bytes = arrived + STATUS_OVERHEAD_BYTES + read.size
        return self._sent_ns + wire_bytes * self.ns_per_byte

    def _stall_ns(self, read: SyncRead, arrived: int, deadline_ns: int, margin_ns: int) -> int:
        """Return when to take a chained reply for stopped."""
        if self._lateness_ns is None:
            return deadline_ns
        patience_ns = 2 * self._lateness_ns
        least_ns = margin_ns * _STALL_PERCENT // 100
        if patience_ns < least_ns:
            patience_ns = least_ns
        stall_ns = self._part_ns(read, arrived) + patience_ns
        return stall_ns if stall_ns < deadline_ns else deadline_ns
