"""Find instruction packets in what the host puts on a bus, as a servo's receiver does.

Beside whole packets it reports those whose check sum fails, because the servo that is addressed
answers them with an error. Behind such a header the search goes on, so that a packet that noise
seems to swallow is still found.

Source: ROBOTIS e-manual, "DYNAMIXEL Protocol 2.0" (instruction packet, status packet: error 3).
"""

import struct
from dataclasses import dataclass
from typing import Final

from drivers.dynamixel.wire.codec import (
    BROADCAST_ID,
    HEADER,
    MAX_LENGTH,
    MAX_SERVO_ID,
    Packet,
    crc16,
    unstuff,
)

_LENGTH: Final = struct.Struct("<H")
_PREFIX_BYTES: Final = 7  # header, id, length
_CRC_BYTES: Final = 2


@dataclass(frozen=True, slots=True)
class BrokenPacket:
    """Hold what can be told of a packet whose check sum fails."""

    servo_id: int
    instruction: int


class InstructionParser:
    """Turn a stream of bytes into packets, whole and broken ones, in their order."""

    def __init__(self) -> None:
        self._buffer = bytearray()

    @property
    def pending_bytes(self) -> int:
        """Return how many bytes wait for the rest of their packet."""
        return len(self._buffer)

    def reset(self) -> None:
        """Drop what is unfinished, as a servo does after a pause within a packet."""
        self._buffer.clear()

    def feed(self, data: bytes) -> list[Packet | BrokenPacket]:
        """Take bytes and return the packets that they complete."""
        self._buffer += data
        found: list[Packet | BrokenPacket] = []
        while self._seek_header():
            end = _PREFIX_BYTES + _LENGTH.unpack_from(self._buffer, 5)[0]
            if len(self._buffer) < end:
                break
            found.append(self._take(end))
        return found

    def _seek_header(self) -> bool:
        """Drop bytes before the next header that makes sense; True when it is there as a whole."""
        buffer = self._buffer
        while True:
            start = buffer.find(HEADER)
            if start < 0:
                del buffer[: max(0, len(buffer) - len(HEADER) + 1)]
                return False
            del buffer[:start]
            if len(buffer) < _PREFIX_BYTES:
                return False
            if self._plausible():
                return True
            del buffer[:1]

    def _plausible(self) -> bool:
        servo_id, length = self._buffer[4], _LENGTH.unpack_from(self._buffer, 5)[0]
        return 3 <= length <= MAX_LENGTH and (servo_id <= MAX_SERVO_ID or servo_id == BROADCAST_ID)

    def _take(self, end: int) -> Packet | BrokenPacket:
        frame = bytes(self._buffer[:end])
        servo_id, instruction = frame[4], frame[_PREFIX_BYTES]
        if crc16(frame[:-_CRC_BYTES]) != _LENGTH.unpack_from(frame, end - _CRC_BYTES)[0]:
            del self._buffer[: len(HEADER)]
            return BrokenPacket(servo_id, instruction)
        del self._buffer[:end]
        params = unstuff(frame[_PREFIX_BYTES:-_CRC_BYTES])[1:]
        return Packet(servo_id, instruction, None, params)
