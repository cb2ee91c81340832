"""Write and read one slot so that a reader never takes a torn one for whole.

A slot is: header (sequence, stamp, pid, length, two words of meta), payload, trailer (CRC-32,
sequence). The sequence stands in front and behind; the CRC covers header and payload, because ARM
may show another core these stores in any order. Images are too long for a CRC at their rate: theirs
covers the header, and the second look at the sequence in front catches a writer that came around.
"""

import mmap
import os
import struct
import zlib
from dataclasses import dataclass

from vla_deploy.ipc.memory.layout import SLOT_HEADER_BYTES, SLOT_TRAILER_BYTES, SlotLayout

_HEADER = struct.Struct("<QqIIII")
_TRAILER = struct.Struct("<IIQ")
_SEQUENCE = struct.Struct("<Q")

Buffer = bytes | bytearray | memoryview


@dataclass(frozen=True, slots=True)
class SlotContent:
    """Carry what one whole slot held."""

    sequence: int
    stamp_ns: int
    writer_pid: int
    meta: tuple[int, int]
    payload: bytes


class SlotWriter:
    """Write slots of one mapped file."""

    def __init__(self, memory: mmap.mmap, layout: SlotLayout, *, payload_crc: bool) -> None:
        self._memory = memory
        self._layout = layout
        self._payload_crc = payload_crc
        self._pid = os.getpid()

    def write(
        self, sequence: int, stamp_ns: int, payload: Buffer, meta: tuple[int, int] = (0, 0)
    ) -> None:
        """Fill the slot of `sequence`: front, payload, then the closing words."""
        length = len(payload)
        header = _HEADER.pack(sequence, stamp_ns, self._pid, length, *meta)
        crc = zlib.crc32(header)
        if self._payload_crc:
            crc = zlib.crc32(payload, crc)
        start = self._layout.offset(sequence)
        body = start + SLOT_HEADER_BYTES
        end = self._layout.trailer_offset(sequence)
        self._memory[start:body] = header
        self._memory[body : body + length] = payload
        self._memory[end : end + SLOT_TRAILER_BYTES] = _TRAILER.pack(crc, 0, sequence)


class SlotReader:
    """Read slots of one mapped file."""

    def __init__(self, memory: mmap.mmap, layout: SlotLayout, *, payload_crc: bool) -> None:
        self._memory = memory
        self._layout = layout
        self._payload_crc = payload_crc

    def front(self, sequence: int) -> int:
        """Return the sequence that now stands in front of the slot of `sequence`."""
        start = self._layout.offset(sequence)
        value: int = _SEQUENCE.unpack_from(self._memory, start)[0]
        return value

    def origin(self, sequence: int) -> tuple[int, int] | None:
        """Return stamp and writer's pid of the slot of `sequence`, or None when it is another."""
        start = self._layout.offset(sequence)
        front, stamp_ns, pid, *_ = _HEADER.unpack_from(self._memory, start)
        _, _, back = _TRAILER.unpack_from(self._memory, self._layout.trailer_offset(sequence))
        if not front == back == sequence or self.front(sequence) != sequence:
            return None
        return stamp_ns, pid

    def read(self, sequence: int) -> SlotContent | None:
        """Copy the slot of `sequence`, or return None when it is not whole or not that one."""
        start = self._layout.offset(sequence)
        body = start + SLOT_HEADER_BYTES
        header = self._memory[start:body]
        front, stamp_ns, pid, length, *meta = _HEADER.unpack(header)
        crc, _, back = _TRAILER.unpack_from(self._memory, self._layout.trailer_offset(sequence))
        if not front == back == sequence or length > self._layout.capacity_bytes:
            return None
        payload = self._memory[body : body + length]
        actual_crc = zlib.crc32(header)
        if self._payload_crc:
            actual_crc = zlib.crc32(payload, actual_crc)
        if actual_crc != crc or self.front(sequence) != sequence:
            return None
        return SlotContent(sequence, stamp_ns, pid, (meta[0], meta[1]), payload)
