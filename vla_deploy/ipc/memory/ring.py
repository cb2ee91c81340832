"""Hand on events in order: bounded, and a slow reader is told how many it lost."""

from dataclasses import dataclass
from typing import Generic

from drivers.clock import NS_PER_S, Clock
from vla_deploy.ipc.memory.document import decode, encode
from vla_deploy.ipc.memory.doorbell import ring_bells
from vla_deploy.ipc.memory.segment import Segment
from vla_deploy.ipc.memory.slot import SlotReader, SlotWriter
from vla_deploy.ipc.topics import P, Topic

_PATIENCE_NS = NS_PER_S // 100  # writers hold a ring for microseconds
_AHEAD = 8  # of a frozen writer, and of those that follow it once it goes on


@dataclass(frozen=True, slots=True, kw_only=True)
class Event(Generic[P]):
    """Carry one event."""

    payload: P
    stamp_ns: int
    sequence: int
    writer_pid: int


class RingWriter(Generic[P]):
    """Publish events of one topic; several processes may."""

    def __init__(self, segment: Segment, topic: Topic[P], clock: Clock) -> None:
        self.unheard = 0
        self._segment = segment
        self._topic = topic
        self._clock = clock
        self._slots = SlotWriter(segment.memory, segment.layout, payload_crc=True)

    def publish(self, payload: P) -> int:
        """Append one event, wake the listeners, and return its sequence.

        Raises:
            BadPayload: not a JSON object, or longer than a slot.
        """
        data = encode(payload, self._topic, self._segment.layout.capacity_bytes)
        with self._segment.locked():
            sequence = self._append(data)
        return self._announce(sequence)

    def force(self, payload: P) -> int:
        """Publish as well where another writer holds the ring for long, as one that is frozen does.

        The slots that it and the next may be writing are left to them; readers count those as torn
        or lost.

        Raises:
            BadPayload: not a JSON object, or longer than a slot.
        """
        data = encode(payload, self._topic, self._segment.layout.capacity_bytes)
        with self._segment.locked_within(_PATIENCE_NS, self._clock) as is_held:
            sequence = self._append(data) if is_held else self._go_past(data)
        return self._announce(sequence)

    def _append(self, data: bytes) -> int:
        sequence = self._segment.newest + 1
        self._slots.write(sequence, self._clock.now_ns(), data)
        self._segment.newest = sequence
        return sequence

    def _go_past(self, data: bytes) -> int:
        """Append without the lock, again where so many went on meanwhile that none would see it."""
        is_ahead = False
        while not is_ahead:
            sequence = self._segment.newest + _AHEAD
            self._slots.write(sequence, self._clock.now_ns(), data)
            is_ahead = self._segment.force_newest(sequence)
        return sequence

    def _announce(self, sequence: int) -> int:
        self.unheard += ring_bells(self._segment.path.parent, self._topic.name)
        return sequence

    def close(self) -> None:
        """Unmap the ring; its events stay readable for others."""
        self._segment.close()


class RingReader(Generic[P]):
    """Read events in order, each once; `lost` were overwritten unread, `torn` were not whole."""

    def __init__(self, segment: Segment, *, from_start: bool) -> None:
        self.lost = 0
        self.torn = 0
        self._segment = segment
        self._slots = SlotReader(segment.memory, segment.layout, payload_crc=True)
        self._position = 0 if from_start else segment.newest

    def drain(self) -> list[Event[P]]:
        """Return every event since the last call, oldest first."""
        newest = self._segment.newest
        if newest == self._position:
            return []
        oldest = max(self._position, newest - self._segment.layout.slots) + 1
        self.lost += oldest - 1 - self._position
        self._position = newest
        events = (self._read(sequence) for sequence in range(oldest, newest + 1))
        return [event for event in events if event is not None]

    def close(self) -> None:
        """Unmap the ring."""
        self._segment.close()

    def _read(self, sequence: int) -> Event[P] | None:
        content = self._slots.read(sequence)
        if content is not None:
            return Event(
                payload=decode(content.payload),
                stamp_ns=content.stamp_ns,
                sequence=sequence,
                writer_pid=content.writer_pid,
            )
        if self._slots.front(sequence) == sequence:
            self.torn += 1
        else:
            self.lost += 1
        return None
