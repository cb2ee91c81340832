"""Play a recording back to a driver: the same requests get the same replies at the same times.

Time starts anew with each request: a reply that came 0.4 ms after its request comes 0.4 ms after it
again, by the injected clock. So a driver may run at another pace than the one that was recorded.
"""

from collections import deque
from collections.abc import Sequence
from typing import Final

from drivers.clock import Clock
from drivers.errors import LinkLost, ProtocolError
from drivers.recording.recording import RecordKind, WireRecord

_PLAYED: Final = frozenset({RecordKind.WRITE, RecordKind.READ, RecordKind.LOST})


class ReplayDiverged(ProtocolError):
    """Say at which record the driver asked something else than was recorded."""


class WireReplay:
    """Be a `ByteTransport` whose other end is a recording."""

    def __init__(self, records: Sequence[WireRecord], clock: Clock) -> None:
        """Start before the first record.

        Raises:
            ValueError: nothing in the recording passed over a byte line.
        """
        self._records = [record for record in records if record.kind in _PLAYED]
        if not self._records:
            raise ValueError("the recording has no byte traffic to replay")
        self._clock = clock
        self._next = 0
        self._due: deque[tuple[int, bytes]] = deque()
        self._lost: WireRecord | None = None
        self._take_replies(self._records[0].stamp_ns)

    @property
    def finished(self) -> bool:
        """Return whether all requests have been made and all replies were read."""
        return self._next == len(self._records) and not self._due

    def write(self, data: bytes) -> None:
        """Take a request, which must be the recorded one.

        Raises:
            ReplayDiverged: another request was recorded, or none any more.
            LinkLost: the link was lost at this place.
        """
        if self._lost is not None:
            raise LinkLost(self._lost.payload.decode(errors="replace"))
        if self._next == len(self._records):
            raise ReplayDiverged(f"the recording ended before the request {data.hex(' ')}")
        record = self._records[self._next]
        if record.payload != data:
            raise ReplayDiverged(
                f"record {self._next}: expected the request {record}; got {data.hex(' ')}; "
                "replay with the settings of the recording"
            )
        self._next += 1
        self._take_replies(record.stamp_ns)

    def read(self, max_bytes: int, deadline_ns: int) -> bytes:
        """Return 1..max_bytes when they are due, or b"" at `deadline_ns`.

        Raises:
            LinkLost: the link was lost at this place.
        """
        if not self._due:
            if self._lost is not None:
                raise LinkLost(self._lost.payload.decode(errors="replace"))
            self._clock.sleep_until(deadline_ns)
            return b""
        due_ns, data = self._due[0]
        if due_ns > max(deadline_ns, self._clock.now_ns()):
            self._clock.sleep_until(deadline_ns)
            return b""
        self._clock.sleep_until(due_ns)
        self._due.popleft()
        if len(data) > max_bytes:
            self._due.appendleft((due_ns, data[max_bytes:]))
        return data[:max_bytes]

    def discard_input(self) -> None:
        """Drop the replies that are due."""
        now_ns = self._clock.now_ns()
        while self._due and self._due[0][0] <= now_ns:
            self._due.popleft()

    def close(self) -> None:
        """Let go of the recording."""
        self._due.clear()

    def _take_replies(self, request_ns: int) -> None:
        """Line up what was received until the next request."""
        now_ns = self._clock.now_ns()
        while self._next < len(self._records):
            record = self._records[self._next]
            if record.kind is RecordKind.WRITE:
                return
            self._next += 1
            if record.kind is RecordKind.LOST:
                self._lost = record
                return
            self._due.append((now_ns + record.stamp_ns - request_ns, record.payload))
