"""Answer SDO requests: expedited both ways, segmented uploads for long texts (CiA 301)."""

import struct
from typing import Final

from sim_twin.can.object_dictionary import ObjectDictionary, SdoAbort

FRAME_BYTES: Final = 8
_HEADER: Final = struct.Struct("<BHB")
_ABORT: Final = struct.Struct("<BHBI")

# Client command specifiers (upper three bits of the first byte)
_DOWNLOAD, _UPLOAD, _UPLOAD_SEGMENT, _ABORTED = 1, 2, 3, 4
_EXPEDITED: Final = 0x02
_SIZED: Final = 0x01
_TOGGLE: Final = 0x10
_LAST: Final = 0x01
SEGMENT_BYTES: Final = 7

TOGGLE_NOT_ALTERNATED: Final = 0x05030000
UNKNOWN_COMMAND: Final = 0x05040001


class SdoServer:
    """Serve one object dictionary; one transfer at a time, as the default SDO channel has it."""

    def __init__(self, objects: ObjectDictionary) -> None:
        self._objects = objects
        self._key = (0, 0)
        self._rest: bytes | None = None
        self._toggle = 0

    def answer(self, request: bytes) -> bytes | None:
        """Return the reply, or None where the standard has none."""
        if len(request) != FRAME_BYTES or request[0] >> 5 == _ABORTED:
            self._rest = None
            return None
        try:
            return self._serve(request)
        except SdoAbort as abort:
            self._rest = None
            return _ABORT.pack(_ABORTED << 5, *self._key, abort.code)

    def _serve(self, request: bytes) -> bytes:
        command = request[0]
        if command >> 5 == _UPLOAD_SEGMENT:
            return self._upload_segment(command)
        _, index, subindex = _HEADER.unpack_from(request)
        self._key = (index, subindex)
        self._rest = None
        if command >> 5 == _UPLOAD:
            return self._upload(self._objects.read(index, subindex))
        if command >> 5 == _DOWNLOAD and command & _EXPEDITED:
            size = 4 - (command >> 2 & 0x3) if command & _SIZED else 4
            self._objects.write(index, subindex, request[4 : 4 + size])
            return _HEADER.pack(0x60, index, subindex) + bytes(4)
        raise SdoAbort(UNKNOWN_COMMAND)

    def _upload(self, data: bytes) -> bytes:
        if len(data) <= 4:
            command = 0x40 | (4 - len(data)) << 2 | _EXPEDITED | _SIZED
            return _HEADER.pack(command, *self._key) + data.ljust(4, b"\0")
        self._rest = data
        self._toggle = 0
        return _HEADER.pack(0x40 | _SIZED, *self._key) + len(data).to_bytes(4, "little")

    def _upload_segment(self, command: int) -> bytes:
        if self._rest is None:
            raise SdoAbort(UNKNOWN_COMMAND)
        if command & _TOGGLE != self._toggle:
            raise SdoAbort(TOGGLE_NOT_ALTERNATED)
        segment, self._rest = self._rest[:SEGMENT_BYTES], self._rest[SEGMENT_BYTES:]
        last = 0 if self._rest else _LAST
        reply = bytes((self._toggle | (SEGMENT_BYTES - len(segment)) << 1 | last,))
        self._toggle ^= _TOGGLE
        if last:
            self._rest = None
        return reply + segment.ljust(SEGMENT_BYTES, b"\0")
