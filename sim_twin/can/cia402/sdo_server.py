"""Answer SDO requests, expedited and segmented, both ways (CiA 301)."""

import struct
from typing import Final

from sim_twin.can.cia402.object_dictionary import WRONG_LENGTH, ObjectDictionary, SdoAbort

FRAME_BYTES: Final = 8
_HEADER: Final = struct.Struct("<BHB")
_ABORT: Final = struct.Struct("<BHBI")

# Client command specifiers (upper three bits of the first byte)
_DOWNLOAD_SEGMENT, _DOWNLOAD, _UPLOAD, _UPLOAD_SEGMENT, _ABORTED = range(5)
_EXPEDITED: Final = 0x02
_SIZED: Final = 0x01
_TOGGLE: Final = 0x10
_LAST: Final = 0x01
_DOWNLOADED: Final = 0x60
_SEGMENT_DOWNLOADED: Final = 0x20
SEGMENT_BYTES: Final = 7
MAX_TRANSFER_BYTES: Final = 1024

TOGGLE_NOT_ALTERNATED: Final = 0x05030000
UNKNOWN_COMMAND: Final = 0x05040001
OUT_OF_MEMORY: Final = 0x05040005


class SdoServer:
    """Serve one object dictionary; one transfer at a time, as the default SDO channel has it."""

    def __init__(self, objects: ObjectDictionary) -> None:
        self._objects = objects
        self._key = (0, 0)
        self._toggle = 0
        self._rest: bytes | None = None
        self._received: bytearray | None = None
        self._announced: int | None = None

    def answer(self, request: bytes) -> bytes | None:
        """Return the reply, or None where the standard has none."""
        if len(request) != FRAME_BYTES or request[0] >> 5 == _ABORTED:
            self._forget()
            return None
        try:
            return self._serve(request)
        except SdoAbort as abort:
            self._forget()
            return _ABORT.pack(_ABORTED << 5, *self._key, abort.code)

    def _forget(self) -> None:
        self._rest = self._received = self._announced = None
        self._toggle = 0

    def _serve(self, request: bytes) -> bytes:
        command = request[0]
        if command >> 5 == _UPLOAD_SEGMENT:
            return self._upload_segment(command)
        if command >> 5 == _DOWNLOAD_SEGMENT:
            return self._download_segment(command, request[1:])
        _, index, subindex = _HEADER.unpack_from(request)
        self._key = (index, subindex)
        self._forget()
        if command >> 5 == _UPLOAD:
            return self._upload(self._objects.read(index, subindex))
        if command >> 5 == _DOWNLOAD:
            return self._download(command, request[4:])
        raise SdoAbort(UNKNOWN_COMMAND)

    def _download(self, command: int, data: bytes) -> bytes:
        if command & _EXPEDITED:
            size = 4 - (command >> 2 & 0x3) if command & _SIZED else 4
            self._objects.write(*self._key, data[:size])
        else:
            self._objects.check_writable(*self._key)
            self._announced = int.from_bytes(data, "little") if command & _SIZED else None
            if self._announced is not None and self._announced > MAX_TRANSFER_BYTES:
                raise SdoAbort(OUT_OF_MEMORY)
            self._received = bytearray()
        return _HEADER.pack(_DOWNLOADED, *self._key) + bytes(4)

    def _download_segment(self, command: int, data: bytes) -> bytes:
        if self._received is None:
            raise SdoAbort(UNKNOWN_COMMAND)
        self._check_toggle(command)
        self._received += data[: SEGMENT_BYTES - (command >> 1 & 0x7)]
        if len(self._received) > MAX_TRANSFER_BYTES:
            raise SdoAbort(OUT_OF_MEMORY)
        reply = bytes((_SEGMENT_DOWNLOADED | command & _TOGGLE,)) + bytes(SEGMENT_BYTES)
        if command & _LAST:
            whole, announced = bytes(self._received), self._announced
            self._forget()
            if announced not in (None, len(whole)):
                raise SdoAbort(WRONG_LENGTH)
            self._objects.write(*self._key, whole)
        return reply

    def _check_toggle(self, command: int) -> None:
        if command & _TOGGLE != self._toggle:
            raise SdoAbort(TOGGLE_NOT_ALTERNATED)
        self._toggle ^= _TOGGLE

    def _upload(self, data: bytes) -> bytes:
        if len(data) <= 4:
            command = 0x40 | (4 - len(data)) << 2 | _EXPEDITED | _SIZED
            return _HEADER.pack(command, *self._key) + data.ljust(4, b"\0")
        self._rest = data
        return _HEADER.pack(0x40 | _SIZED, *self._key) + len(data).to_bytes(4, "little")

    def _upload_segment(self, command: int) -> bytes:
        if self._rest is None:
            raise SdoAbort(UNKNOWN_COMMAND)
        self._check_toggle(command)
        segment, self._rest = self._rest[:SEGMENT_BYTES], self._rest[SEGMENT_BYTES:]
        last = 0 if self._rest else _LAST
        reply = bytes((command & _TOGGLE | (SEGMENT_BYTES - len(segment)) << 1 | last,))
        if last:
            self._forget()
        return reply + segment.ljust(SEGMENT_BYTES, b"\0")
