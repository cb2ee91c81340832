"""Share the newest images: a reader copies one and checks that nobody wrote it meanwhile."""

from dataclasses import dataclass
from typing import Any

from drivers.clock import NS_PER_S
from vla_deploy.ipc.errors import BadPayload
from vla_deploy.ipc.memory.doorbell import ring_bells
from vla_deploy.ipc.memory.segment import Segment
from vla_deploy.ipc.memory.slot import Buffer, SlotReader, SlotWriter
from vla_deploy.ipc.topics import Topic


@dataclass(frozen=True, slots=True, kw_only=True)
class Frame:
    """Carry one image; `stamp_ns` is when it was taken."""

    payload: bytes
    width: int
    height: int
    stamp_ns: int
    sequence: int
    writer_pid: int

    def age_s(self, now_ns: int) -> float:
        """Return how long ago the image was taken."""
        return (now_ns - self.stamp_ns) / NS_PER_S


class FrameWriter:
    """Put images of one topic; a single process owns it."""

    def __init__(self, segment: Segment, topic: Topic[Any]) -> None:
        self.unheard = 0
        self._segment = segment
        self._topic = topic
        self._slots = SlotWriter(segment.memory, segment.layout, payload_crc=False)

    def put(self, payload: Buffer, *, width: int, height: int, stamp_ns: int) -> None:
        """Publish one image and wake the listeners.

        Raises:
            BadPayload: the image is larger than a slot.
        """
        limit_bytes = self._segment.layout.capacity_bytes
        if len(payload) > limit_bytes:
            size = f"{width} x {height} image of {len(payload)} bytes"
            raise BadPayload(f"topic {self._topic.name}: {size}, limit {limit_bytes}")
        sequence = self._segment.newest + 1
        self._slots.write(sequence, stamp_ns, payload, (width, height))
        self._segment.newest = sequence
        self.unheard += ring_bells(self._segment.path.parent, self._topic.name)

    def close(self) -> None:
        """Unmap the ring; its images stay readable for others."""
        self._segment.close()


class FrameReader:
    """Get the newest whole image."""

    def __init__(self, segment: Segment) -> None:
        self._segment = segment
        self._slots = SlotReader(segment.memory, segment.layout, payload_crc=False)

    def latest(self) -> Frame | None:
        """Copy the newest whole image, or return None when there is none yet."""
        newest = self._segment.newest
        oldest = max(1, newest - self._segment.layout.slots + 2)
        for sequence in range(newest, oldest - 1, -1):
            content = self._slots.read(sequence)
            if content is not None:
                return Frame(
                    payload=content.payload,
                    width=content.meta[0],
                    height=content.meta[1],
                    stamp_ns=content.stamp_ns,
                    sequence=sequence,
                    writer_pid=content.writer_pid,
                )
        return None

    def close(self) -> None:
        """Unmap the ring; frames stay valid."""
        self._segment.close()
