"""Keep the last binary records of one writer: it never waits, and they outlive it.

A record longer than a slot takes several; two words in each slot say which part of how many.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from drivers.clock import Clock
from vla_deploy.ipc.errors import BadPayload
from vla_deploy.ipc.memory.segment import Segment
from vla_deploy.ipc.memory.slot import SlotContent, SlotReader, SlotWriter
from vla_deploy.ipc.topics import Topic


@dataclass(frozen=True, slots=True, kw_only=True)
class Record:
    """Carry one whole record."""

    payload: bytes
    stamp_ns: int
    sequence: int
    writer_pid: int


class RecordWriter:
    """Append records of one topic; a single process owns it, and nobody is woken."""

    def __init__(self, segment: Segment, topic: Topic[Any], clock: Clock) -> None:
        self._segment = segment
        self._topic = topic
        self._clock = clock
        self._slots = SlotWriter(segment.memory, segment.layout, payload_crc=True)

    def append(self, payload: bytes) -> None:
        """Append one record.

        Raises:
            BadPayload: longer than half of the ring.
        """
        capacity = self._segment.layout.capacity_bytes
        parts = max(1, -(-len(payload) // capacity))
        if parts > self._segment.layout.slots // 2:
            raise BadPayload(
                f"topic {self._topic.name}: record of {len(payload)} bytes, limit "
                f"{self._segment.layout.slots // 2 * capacity}"
            )
        now_ns, sequence = self._clock.now_ns(), self._segment.newest
        for part in range(parts):
            sequence += 1
            chunk = payload[part * capacity : (part + 1) * capacity]
            self._slots.write(sequence, now_ns, chunk, (part, parts))
        self._segment.newest = sequence

    def close(self) -> None:
        """Unmap the ring; its records stay readable for others."""
        self._segment.close()


class RecordReader:
    """Read the records that the ring still holds; what is not whole is left out."""

    def __init__(self, segment: Segment) -> None:
        self._segment = segment
        self._slots = SlotReader(segment.memory, segment.layout, payload_crc=True)
        self._position = segment.newest

    def held(self, since_ns: int = 0) -> list[Record]:
        """Return every whole record that was appended at `since_ns` or later, oldest first."""
        newest = self._segment.newest
        oldest = max(1, newest - self._segment.layout.slots + 1)
        return list(self._records(oldest, newest, since_ns))

    def fresh(self) -> list[Record]:
        """Return every whole record since the last call, at first since opening, oldest first."""
        newest = self._segment.newest
        oldest = max(self._position, newest - self._segment.layout.slots) + 1
        self._position = newest
        return list(self._records(oldest, newest, 0))

    def close(self) -> None:
        """Unmap the ring."""
        self._segment.close()

    def _records(self, oldest: int, newest: int, since_ns: int) -> Iterator[Record]:
        parts: list[SlotContent] = []
        for sequence in range(oldest, newest + 1):
            content = self._slots.read(sequence)
            if content is None or content.stamp_ns < since_ns:
                parts = []
                continue
            part, count = content.meta
            parts = [content] if part == 0 else [*parts, content]
            if part + 1 == count == len(parts):
                yield Record(
                    payload=b"".join(one.payload for one in parts),
                    stamp_ns=content.stamp_ns,
                    sequence=sequence,
                    writer_pid=content.writer_pid,
                )
