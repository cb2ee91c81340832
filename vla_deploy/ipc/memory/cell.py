"""Share the newest value of something: the writer never waits, the reader never blocks."""

from dataclasses import dataclass
from typing import Any, Generic

import numpy as np

from drivers.clock import NS_PER_S, Clock
from vla_deploy.ipc.errors import BadPayload
from vla_deploy.ipc.memory.document import decode, encode
from vla_deploy.ipc.memory.layout import is_document, record_dtype
from vla_deploy.ipc.memory.record import Scratch
from vla_deploy.ipc.memory.segment import Segment
from vla_deploy.ipc.memory.slot import SlotContent, SlotReader, SlotWriter
from vla_deploy.ipc.topics import P, Topic

_READ_ROUNDS = 4


@dataclass(frozen=True, slots=True, kw_only=True)
class Sample(Generic[P]):
    """Carry one whole value of a cell; its bytes are a private, read-only copy."""

    topic: str
    payload: bytes
    dtype: "np.dtype[np.void] | None"
    stamp_ns: int
    sequence: int
    writer_pid: int

    @property
    def data(self) -> np.void:
        """Return the packed fields, read by name.

        Raises:
            BadPayload: the topic carries a JSON document.
        """
        if self.dtype is None:
            raise BadPayload(f"topic {self.topic} carries a JSON document: call document()")
        record: np.void = np.frombuffer(self.payload, self.dtype)[0]
        return record

    def document(self) -> P:
        """Return the JSON object.

        Raises:
            BadPayload: the topic carries packed fields.
        """
        if self.dtype is not None:
            raise BadPayload(f"topic {self.topic} carries packed fields: read data[name]")
        document: P = decode(self.payload)
        return document

    def age_s(self, now_ns: int) -> float:
        """Return how long ago the value was put."""
        return (now_ns - self.stamp_ns) / NS_PER_S


class CellWriter(Generic[P]):
    """Put values of one cell, one process at a time."""

    def __init__(self, segment: Segment, topic: Topic[P], clock: Clock) -> None:
        self._segment = segment
        self._topic = topic
        self._clock = clock
        self._slots = SlotWriter(segment.memory, segment.layout, payload_crc=True)
        self._scratch = None if is_document(topic) else Scratch(topic)

    @property
    def record(self) -> np.void:
        """Return the scratch record to fill before `commit`, the fastest way to put.

        Raises:
            BadPayload: the topic carries a JSON document.
        """
        return self._packed().record

    def commit(self) -> None:
        """Publish what `record` holds."""
        self._publish(self._packed().payload)

    def put(self, **fields: Any) -> None:
        """Publish all packed fields at once; a shorter array leaves zeros behind it.

        Raises:
            BadPayload: a field is missing, unknown, or does not fit its declaration.
        """
        scratch = self._packed()
        scratch.fill(fields)
        self._publish(scratch.payload)

    def put_document(self, document: P) -> None:
        """Publish a JSON object.

        Raises:
            BadPayload: not JSON, too long, or the topic carries packed fields.
        """
        if self._scratch is not None:
            raise BadPayload(f"topic {self._topic.name} carries packed fields: call put()")
        limit_bytes = self._segment.layout.capacity_bytes
        self._publish(encode(document, self._topic, limit_bytes))

    def close(self) -> None:
        """Unmap the cell; its newest value stays readable for others."""
        self._segment.close()

    def _packed(self) -> Scratch:
        if self._scratch is None:
            name = self._topic.name
            raise BadPayload(f"topic {name} carries a JSON document: call put_document()")
        return self._scratch

    def _publish(self, payload: bytes | memoryview) -> None:
        sequence = self._segment.newest + 1
        self._slots.write(sequence, self._clock.now_ns(), payload)
        self._segment.newest = sequence


class CellReader(Generic[P]):
    """Get the newest whole value of one cell; `torn` counts the slots that were not whole."""

    def __init__(self, segment: Segment, topic: Topic[P]) -> None:
        self.torn = 0
        self._segment = segment
        self._topic = topic
        self._dtype = None if is_document(topic) else record_dtype(topic)
        self._slots = SlotReader(segment.memory, segment.layout, payload_crc=True)
        self._last: Sample[P] | None = None

    def latest(self) -> Sample[P] | None:
        """Return the newest whole value, or None before the first one.

        A torn slot falls back to the one before it; should the writer come around during every
        attempt, the value of the last call is returned, its age tells.
        """
        for _ in range(_READ_ROUNDS):
            newest = self._segment.newest
            if newest == (0 if self._last is None else self._last.sequence):
                break
            content = self._newest_whole(newest)
            if content is not None:
                self._last = self._sample(content)
                break
        return self._last

    def close(self) -> None:
        """Unmap the cell; samples stay valid."""
        self._segment.close()

    def _newest_whole(self, newest: int) -> SlotContent | None:
        oldest = max(1, newest - self._segment.layout.slots + 2)
        for sequence in range(newest, oldest - 1, -1):
            content = self._slots.read(sequence)
            if content is not None:
                return content
            self.torn += 1
        return None

    def _sample(self, content: SlotContent) -> Sample[P]:
        return Sample(
            topic=self._topic.name,
            payload=content.payload,
            dtype=self._dtype,
            stamp_ns=content.stamp_ns,
            sequence=content.sequence,
            writer_pid=content.writer_pid,
        )
