"""Derive the bytes of shared memory from a topic's declaration."""

import zlib
from dataclasses import dataclass
from typing import Any

import numpy as np

from vla_deploy.ipc.topics import Topic, TopicKind

VERSION = 1
FILE_HEADER_BYTES = 128
SLOT_HEADER_BYTES = 32
SLOT_TRAILER_BYTES = 16
_CACHE_LINE_BYTES = 64
_SUFFIX = {
    TopicKind.CELL: "cell",
    TopicKind.RING: "ring",
    TopicKind.FRAME: "frames",
    TopicKind.RECORD: "records",
}


@dataclass(frozen=True, slots=True, kw_only=True)
class SlotLayout:
    """Place the slots of one topic behind the file header."""

    slots: int
    capacity_bytes: int
    stride_bytes: int

    @property
    def file_bytes(self) -> int:
        """Return the size of the whole file."""
        return FILE_HEADER_BYTES + self.slots * self.stride_bytes

    def offset(self, sequence: int) -> int:
        """Return where the slot of `sequence` begins."""
        return FILE_HEADER_BYTES + (sequence % self.slots) * self.stride_bytes

    def trailer_offset(self, sequence: int) -> int:
        """Return where the closing check words of the slot of `sequence` begin."""
        return self.offset(sequence) + self.stride_bytes - SLOT_TRAILER_BYTES


def layout_of(topic: Topic[Any]) -> SlotLayout:
    """Lay out a topic: slot header, payload, trailer, rounded up to cache lines."""
    capacity = payload_capacity(topic)
    used = SLOT_HEADER_BYTES + capacity + SLOT_TRAILER_BYTES
    stride = -(-used // _CACHE_LINE_BYTES) * _CACHE_LINE_BYTES
    return SlotLayout(slots=max(topic.slots, 3), capacity_bytes=capacity, stride_bytes=stride)


def payload_capacity(topic: Topic[Any]) -> int:
    """Return how many payload bytes one slot of the topic takes."""
    if topic.kind is not TopicKind.CELL:
        return topic.slot_bytes
    if is_document(topic):
        return topic.fields[0].shape
    return record_dtype(topic).itemsize


def is_document(topic: Topic[Any]) -> bool:
    """Return whether a cell carries one bounded JSON text instead of packed fields."""
    return any(field.dtype == "json" for field in topic.fields)


def record_dtype(topic: Topic[Any]) -> "np.dtype[np.void]":
    """Build the little-endian, aligned record of a packed cell."""
    columns = [
        (field.name, f"<{field.dtype}", (field.shape,) if field.shape > 1 else ())
        for field in topic.fields
    ]
    return np.dtype(columns, align=True)


def schema_hash(topic: Topic[Any]) -> int:
    """Sum up everything that decides the bytes; two processes must agree on it."""
    fields = ",".join(f"{field.name}:{field.dtype}:{field.shape}" for field in topic.fields)
    text = f"{VERSION}|{topic.name}|{topic.kind.name}|{topic.slots}|{topic.slot_bytes}|{fields}"
    return zlib.crc32(text.encode())


def file_name(topic: Topic[Any]) -> str:
    """Name the topic's file inside the shared directory."""
    return f"{topic.name}.{_SUFFIX[topic.kind]}"
