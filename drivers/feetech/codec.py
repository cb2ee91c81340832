"""Encode and decode packets of FEETECH STS, SMS and SCS servos.

    FF FF | ID | LEN | INST or ERR | params | CHK        LEN = params + 2, CHK = ~sum(ID .. params)

Source: FEETECH, "SMS/STS communication protocol". Nothing is stuffed, and a check sum of one byte
lets one damaged frame in 256 pass: who asks also compares id and length of an answer.
"""

from dataclasses import dataclass
from enum import IntEnum
from typing import Final

FEETECH_HEADER: Final = b"\xff\xff"
FEETECH_BROADCAST_ID: Final = 254
FEETECH_MAX_ID: Final = 253
OVERHEAD_BYTES: Final = 6
"""Bytes of a packet beside its params."""
MAX_PARAMS: Final = 250
_MOST_LENGTH: Final = MAX_PARAMS + 2


class FeetechInstruction(IntEnum):
    """Name the instructions; RESTORE, BACKUP and the following two are of STS and SMS only."""

    PING = 0x01
    READ = 0x02
    WRITE = 0x03
    REG_WRITE = 0x04
    ACTION = 0x05
    RESTORE = 0x06
    REBOOT = 0x08
    BACKUP = 0x09
    RESET_STATE = 0x0A
    CALIBRATE_POSITION = 0x0B
    SYNC_READ = 0x82
    SYNC_WRITE = 0x83


@dataclass(frozen=True, slots=True)
class FeetechPacket:
    """Hold one packet; `code` is the instruction of a request or the error byte of a status."""

    servo_id: int
    code: int
    params: bytes


def check_sum(body: bytes | bytearray) -> int:
    """Return the check sum of what lies between header and check sum."""
    return ~sum(body) & 0xFF


def encode_packet(servo_id: int, code: int, params: bytes = b"") -> bytes:
    """Return a request (`code` is its instruction) or a status (its error byte) for the wire.

    Raises:
        ValueError: the id is no address, or there are too many params.
    """
    if not 0 <= servo_id <= FEETECH_BROADCAST_ID:
        raise ValueError(f"servo id must be 0..{FEETECH_BROADCAST_ID}, got {servo_id}")
    if len(params) > MAX_PARAMS:
        raise ValueError(f"a packet holds at most {MAX_PARAMS} params, got {len(params)}")
    body = bytes((servo_id, len(params) + 2, code)) + params
    return FEETECH_HEADER + body + bytes((check_sum(body),))


class FeetechParser:
    """Find packets in a stream with noise and cuts.

    What begins like a packet and is none costs only its first byte: a whole packet behind it, or
    inside it, is still found.
    """

    def __init__(self) -> None:
        self.check_errors = 0
        self.discarded_bytes = 0
        self._buffer = bytearray()

    @property
    def pending_bytes(self) -> int:
        """Return how many bytes wait for the rest of their packet."""
        return len(self._buffer)

    def feed(self, data: bytes) -> list[FeetechPacket]:
        """Take received bytes; return the packets that are complete now, in order."""
        self._buffer += data
        found: list[FeetechPacket] = []
        while (packet := self._next()) is not None:
            found.append(packet)
        return found

    def salvage(self) -> list[FeetechPacket]:
        """Give up on the unfinished packet and return those hidden behind its header."""
        found: list[FeetechPacket] = []
        while self._buffer:
            self._discard(1)
            found += self.feed(b"")
        return found

    def reset(self) -> None:
        """Drop what is unfinished."""
        self._discard(len(self._buffer))

    def _next(self) -> FeetechPacket | None:
        buffer = self._buffer
        while self._seek_header():
            servo_id, length = buffer[2], buffer[3]
            if servo_id > FEETECH_BROADCAST_ID or not 2 <= length <= _MOST_LENGTH:
                self._discard(1)
                continue
            end = 4 + length
            if len(buffer) < end:
                return None
            if check_sum(buffer[2 : end - 1]) == buffer[end - 1]:
                packet = FeetechPacket(servo_id, buffer[4], bytes(buffer[5 : end - 1]))
                del buffer[:end]
                return packet
            self.check_errors += 1
            self._discard(1)
        return None

    def _seek_header(self) -> bool:
        """Drop bytes before the next header; True when its id and length are there too."""
        start = self._buffer.find(FEETECH_HEADER)
        if start < 0:
            self._discard(len(self._buffer) - self._buffer.endswith(FEETECH_HEADER[:1]))
            return False
        self._discard(start)
        return len(self._buffer) >= 4

    def _discard(self, count: int) -> None:
        self.discarded_bytes += count
        del self._buffer[:count]
