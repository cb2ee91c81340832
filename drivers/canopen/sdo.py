"""Read and write a node's objects by SDO, expedited and segmented, one step at a time (CiA 301).

A transfer is a generator: it sends its request and yields until the reply has been handed in by
`take_reply`. So the control loop goes on while a drive is configured.
"""

import struct
from collections import deque
from collections.abc import Callable, Generator
from typing import Final

from drivers.canopen.objects import SDO_REQUEST_COB
from drivers.canopen.sdo_abort import ABORT_TEXTS
from drivers.clock import Clock
from drivers.errors import NoReply, ProtocolError, WrongDevice

SDO_TIMEOUT_NS: Final = 300_000_000
MAX_OBJECT_BYTES: Final = 1 << 16
FRAME_BYTES: Final = 8
MAX_REPLIES: Final = 8
SEGMENT_BYTES: Final = 7
EXPEDITED_BYTES: Final = 4
_HEADER: Final = struct.Struct("<BHB")
_ABORT: Final = struct.Struct("<BHBI")

# Client and server command specifiers, the upper three bits of the first byte
START_DOWNLOAD, START_UPLOAD, UPLOAD_SEGMENT, ABORTED = 1 << 5, 2 << 5, 3 << 5, 4 << 5
DOWNLOADED, UPLOADED, SEGMENT_TAKEN = 3 << 5, 2 << 5, 1 << 5
SPECIFIER: Final = 0xE0
SIZED, EXPEDITED, LAST, TOGGLE = 0x01, 0x02, 0x01, 0x10

TOGGLE_NOT_ALTERNATED: Final = 0x0503_0000
UNKNOWN_COMMAND: Final = 0x0504_0001
OUT_OF_MEMORY: Final = 0x0504_0005
WRONG_LENGTH: Final = 0x0607_0010

Reading = Generator[None, None, bytes]
Writing = Generator[None, None, None]


class SdoAborted(WrongDevice):
    """Say that a node refuses an access, with the standard's code in words."""

    def __init__(self, what: str, code: int) -> None:
        reason = ABORT_TEXTS.get(code, "an abort code outside CiA 301")
        super().__init__(f"{what}: refused with 0x{code:08X}, {reason}")
        self.code = code


class SdoClient:
    """Talk to the SDO server of one node over its default channel; one transfer at a time."""

    def __init__(
        self,
        send: Callable[[int, bytes], None],
        node_id: int,
        name: str,
        clock: Clock,
        timeout_ns: int = SDO_TIMEOUT_NS,
    ) -> None:
        self._send = send
        self._request_id = SDO_REQUEST_COB + node_id
        self._name = name
        self._clock = clock
        self._timeout_ns = timeout_ns
        self._replies: deque[bytes] = deque(maxlen=MAX_REPLIES)
        self.replies_refused = 0

    def take_reply(self, data: bytes, now_ns: int) -> None:
        """Take a frame of the node's SDO channel.

        Raises:
            ProtocolError: it is not eight bytes long.
        """
        if len(data) != FRAME_BYTES:
            raise ProtocolError(f"SDO reply has {len(data)} bytes, expected {FRAME_BYTES}")
        self._replies.append(data)

    def upload(self, index: int, subindex: int = 0) -> Reading:
        """Read an object.

        Raises:
            NoReply: the node is silent.
            SdoAborted: the node refuses.
            ProtocolError: the reply does not fit the request.
        """
        what = f"{self._name}: reading 0x{index:04X}:{subindex:X}"
        reply = yield from self._ask(_HEADER.pack(START_UPLOAD, index, subindex) + bytes(4), what)
        command = reply[0]
        if command & SPECIFIER != UPLOADED:
            self._abort(index, subindex, UNKNOWN_COMMAND)
            raise ProtocolError(f"{what}: reply 0x{command:02X} is no upload response")
        if command & EXPEDITED:
            size = EXPEDITED_BYTES - (command >> 2 & 3) if command & SIZED else EXPEDITED_BYTES
            return reply[4 : 4 + size]
        size_told = int.from_bytes(reply[4:8], "little") if command & SIZED else None
        return (yield from self._upload_segments(index, subindex, size_told, what))

    def _upload_segments(self, index: int, subindex: int, size: int | None, what: str) -> Reading:
        data, toggle = bytearray(), 0
        while len(data) <= MAX_OBJECT_BYTES:
            reply = yield from self._ask(bytes((UPLOAD_SEGMENT | toggle,)) + bytes(7), what)
            command = reply[0]
            if command & SPECIFIER or command & TOGGLE != toggle:
                self._abort(index, subindex, TOGGLE_NOT_ALTERNATED)
                raise ProtocolError(f"{what}: segment 0x{command:02X} is out of order")
            data += reply[1 : 1 + SEGMENT_BYTES - (command >> 1 & 7)]
            if command & LAST:
                return self._whole(index, subindex, bytes(data), size, what)
            toggle ^= TOGGLE
        self._abort(index, subindex, OUT_OF_MEMORY)
        raise ProtocolError(f"{what}: longer than {MAX_OBJECT_BYTES} bytes")

    def _whole(self, index: int, subindex: int, data: bytes, size: int | None, what: str) -> bytes:
        if size is not None and size != len(data):
            self._abort(index, subindex, WRONG_LENGTH)
            raise ProtocolError(f"{what}: {len(data)} bytes came, {size} were announced")
        return data

    def download(self, index: int, subindex: int, data: bytes) -> Writing:
        """Write an object.

        Raises:
            NoReply: the node is silent.
            SdoAborted: the node refuses.
            ProtocolError: the reply does not fit the request.
        """
        what = f"{self._name}: writing {data.hex(' ')} to 0x{index:04X}:{subindex:X}"
        expedited = 0 < len(data) <= EXPEDITED_BYTES
        if expedited:
            command = START_DOWNLOAD | (EXPEDITED_BYTES - len(data)) << 2 | EXPEDITED | SIZED
            first = data.ljust(EXPEDITED_BYTES, b"\0")
        else:
            command, first = START_DOWNLOAD | SIZED, len(data).to_bytes(4, "little")
        reply = yield from self._ask(_HEADER.pack(command, index, subindex) + first, what)
        if reply[0] & SPECIFIER != DOWNLOADED:
            self._abort(index, subindex, UNKNOWN_COMMAND)
            raise ProtocolError(f"{what}: reply 0x{reply[0]:02X} is no download response")
        if not expedited:
            yield from self._download_segments(index, subindex, data, what)

    def _download_segments(self, index: int, subindex: int, data: bytes, what: str) -> Writing:
        toggle = 0
        for start in range(0, max(1, len(data)), SEGMENT_BYTES):
            segment = data[start : start + SEGMENT_BYTES]
            last = LAST if start + SEGMENT_BYTES >= len(data) else 0
            command = toggle | (SEGMENT_BYTES - len(segment)) << 1 | last
            frame = bytes((command,)) + segment.ljust(SEGMENT_BYTES, b"\0")
            reply = yield from self._ask(frame, what)
            if reply[0] & (SPECIFIER | TOGGLE) != SEGMENT_TAKEN | toggle:
                self._abort(index, subindex, TOGGLE_NOT_ALTERNATED)
                raise ProtocolError(f"{what}: segment response 0x{reply[0]:02X} is out of order")
            toggle ^= TOGGLE

    def _ask(self, request: bytes, what: str) -> Reading:
        """Send a frame and return its reply; a late reply about another object is passed over."""
        starts = request[0] & SPECIFIER in (START_UPLOAD, START_DOWNLOAD)
        self._replies.clear()
        self._send(self._request_id, request)
        deadline_ns = self._clock.now_ns() + self._timeout_ns
        while True:
            while self._replies:
                reply = self._replies.popleft()
                if reply[0] & SPECIFIER == ABORTED:
                    raise SdoAborted(what, _ABORT.unpack(reply)[3])
                if not starts or reply[1:4] == request[1:4]:
                    return reply
                self.replies_refused += 1
            if self._clock.now_ns() > deadline_ns:
                self._send(self._request_id, _ABORT.pack(ABORTED, 0, 0, 0x0504_0000))
                raise NoReply(
                    f"{what}: no reply in {self._timeout_ns // 1_000_000} ms; check its power, "
                    "node id, bit rate and the bus termination"
                )
            yield

    def _abort(self, index: int, subindex: int, code: int) -> None:
        self._send(self._request_id, _ABORT.pack(ABORTED, index, subindex, code))
