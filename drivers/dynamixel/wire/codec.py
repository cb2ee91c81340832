"""Encode and decode Dynamixel Protocol 2.0 packets.

    FF FF FD 00 | ID | LEN lo hi | INST [ERR] | params | CRC lo hi        LEN counts INST .. CRC

Source: ROBOTIS e-manual, "DYNAMIXEL Protocol 2.0". A sequence FF FF FD between INST and the end of
the params is stuffed to FF FF FD FD. The one exception is the fast sync read's reply (ID FE), which
several servos write together:

    header | [ERR ID data CRC] x n        each CRC covers all bytes before it, earlier CRCs included
"""

import struct
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from enum import IntEnum
from typing import Final

HEADER: Final = b"\xff\xff\xfd\x00"
BROADCAST_ID: Final = 254
MAX_SERVO_ID: Final = 252
ALERT: Final = 0x80
MAX_LENGTH: Final = 4096
"""Longest LEN taken for real; a larger one is noise that looks like a header."""

STUFFED_PATTERN: Final = b"\xff\xff\xfd"
"""What is stuffed wherever it occurs between INST and the end of the params."""
_STUFFED: Final = b"\xff\xff\xfd\xfd"
_LENGTH: Final = struct.Struct("<H")
_PREFIX_BYTES: Final = 7  # header, id, length
_CRC_BYTES: Final = 2


class Instruction(IntEnum):
    """Name the instructions of Protocol 2.0."""

    PING = 0x01
    READ = 0x02
    WRITE = 0x03
    REG_WRITE = 0x04
    ACTION = 0x05
    FACTORY_RESET = 0x06
    REBOOT = 0x08
    CLEAR = 0x10
    CONTROL_TABLE_BACKUP = 0x20
    STATUS = 0x55
    SYNC_READ = 0x82
    SYNC_WRITE = 0x83
    FAST_SYNC_READ = 0x8A
    BULK_READ = 0x92
    BULK_WRITE = 0x93
    FAST_BULK_READ = 0x9A


class StatusError(IntEnum):
    """Name the error numbers of a status packet (bits 0..6; bit 7 is `ALERT`)."""

    NONE = 0
    RESULT_FAIL = 1
    INSTRUCTION = 2
    CRC = 3
    DATA_RANGE = 4
    DATA_LENGTH = 5
    DATA_LIMIT = 6
    ACCESS = 7


@dataclass(frozen=True, slots=True)
class Packet:
    """Hold one packet without its stuffing.

    `error` is None for an instruction and for a fast sync reply, whose `params` still hold the
    entries as they came (see `decode_fast_entries`).
    """

    servo_id: int
    instruction: int
    error: int | None
    params: bytes


def _crc_table() -> tuple[int, ...]:
    table = []
    for byte in range(256):
        crc = byte << 8
        for _ in range(8):
            crc = (crc << 1) ^ (0x8005 if crc & 0x8000 else 0)
        table.append(crc & 0xFFFF)
    return tuple(table)


_CRC_TABLE: Final = _crc_table()


def table_crc16(data: bytes | memoryview) -> int:
    """Return the CRC-16/UMTS of `data` without compiled code."""
    crc = 0
    table = _CRC_TABLE
    for byte in data:
        crc = ((crc << 8) & 0xFFFF) ^ table[(crc >> 8) ^ byte]
    return crc


def _fastest_crc16() -> Callable[[bytes | memoryview], int]:
    try:
        from fastcrc.crc16 import umts
    except ImportError:  # no wheel for this machine: costs about 50 us more per bus cycle
        return table_crc16
    return umts


crc16: Final = _fastest_crc16()
"""Return the CRC-16/UMTS of bytes (poly 0x8005, init 0, not reflected)."""


def _frame(servo_id: int, payload: bytes) -> bytes:
    length = len(payload) + _CRC_BYTES
    if not (0 <= servo_id <= MAX_SERVO_ID or servo_id == BROADCAST_ID):
        raise ValueError(f"servo id must be 0..{MAX_SERVO_ID} or {BROADCAST_ID}, got {servo_id}")
    if length > MAX_LENGTH:
        raise ValueError(f"packet length must be at most {MAX_LENGTH} bytes, got {length}")
    body = HEADER + bytes((servo_id, length & 0xFF, length >> 8)) + payload
    return body + _LENGTH.pack(crc16(body))


def stuff(payload: bytes) -> bytes:
    """Insert FD behind every FF FF FD."""
    return payload.replace(STUFFED_PATTERN, _STUFFED)


def unstuff(payload: bytes) -> bytes:
    """Undo `stuff`."""
    return payload.replace(_STUFFED, STUFFED_PATTERN)


def encode_instruction(servo_id: int, instruction: int, params: bytes = b"") -> bytes:
    """Return an instruction packet ready for the wire.

    Raises:
        ValueError: the id is not an address or the packet is too long.
    """
    return _frame(servo_id, stuff(bytes((instruction,)) + params))


def encode_status(servo_id: int, error: int, params: bytes = b"") -> bytes:
    """Return a status packet ready for the wire.

    Raises:
        ValueError: the id is not an address or the packet is too long.
    """
    return _frame(servo_id, stuff(bytes((Instruction.STATUS, error)) + params))


def encode_fast_status(entries: Sequence[tuple[int, int, bytes]]) -> bytes:
    """Return the joint reply to a fast sync read; an entry is (error, id, data).

    Raises:
        ValueError: there is no entry.
    """
    if not entries:
        raise ValueError("a fast sync reply needs at least one entry, got none")
    length = 1 + sum(len(data) + 4 for _, _, data in entries)
    frame = HEADER + bytes((BROADCAST_ID, length & 0xFF, length >> 8, Instruction.STATUS))
    for error, servo_id, data in entries:
        frame += bytes((error, servo_id)) + data
        frame += _LENGTH.pack(crc16(frame))
    return frame


def decode_fast_entries(frame: bytes, data_bytes: int) -> list[tuple[int, int, bytes]]:
    """Return the (error, id, data) entries of a fast sync reply up to the first broken one.

    `frame` starts at its header and may be cut short: each entry proves itself by its own CRC.
    """
    entries = []
    start = _PREFIX_BYTES + 1
    while start + data_bytes + 4 <= len(frame):
        end = start + 2 + data_bytes
        if crc16(frame[:end]) != _LENGTH.unpack_from(frame, end)[0]:
            break
        entries.append((frame[start], frame[start + 1], frame[start + 2 : end]))
        start = end + _CRC_BYTES
    return entries


def _decode(frame: bytes) -> Packet | None:
    """Return the packet of a frame whose CRC holds, None where its inside makes no sense."""
    servo_id, instruction = frame[4], frame[_PREFIX_BYTES]
    payload = frame[_PREFIX_BYTES + 1 : -_CRC_BYTES]
    if instruction != Instruction.STATUS:
        return Packet(servo_id, instruction, None, unstuff(frame[_PREFIX_BYTES:-_CRC_BYTES])[1:])
    if servo_id == BROADCAST_ID:
        return Packet(servo_id, instruction, None, payload)
    if not payload:
        return None
    return Packet(servo_id, instruction, payload[0], unstuff(payload)[1:])


class PacketParser:
    """Find packets in a stream with noise, cuts and stuffing.

    A header with an impossible id or length, or a frame whose CRC fails, costs only its first byte:
    the search goes on right behind it, so that a whole packet inside a broken one is still found.
    """

    def __init__(self) -> None:
        self.crc_errors = 0
        self.discarded_bytes = 0
        self._buffer = bytearray()

    @property
    def pending_bytes(self) -> int:
        """Return how many bytes wait for the rest of their packet."""
        return len(self._buffer)

    def feed(self, data: bytes) -> None:
        """Add received bytes."""
        self._buffer += data

    def packets(self) -> list[Packet]:
        """Return the packets completed so far, in order."""
        found = []
        while (frame := self._next_frame()) is not None:
            packet = _decode(frame)
            if packet is not None:
                found.append(packet)
        return found

    def salvage(self) -> list[Packet]:
        """Give up on the unfinished packet and return those hidden behind its header."""
        found = self.packets()
        while self._buffer:
            self._discard(1)
            found += self.packets()
        return found

    def reset(self) -> None:
        """Drop what is unfinished, as a servo does after a pause of 1.5 ms within a packet."""
        self._discard(len(self._buffer))

    def _discard(self, count: int) -> None:
        self.discarded_bytes += count
        del self._buffer[:count]

    def _next_frame(self) -> bytes | None:
        while self._seek_header():
            length = _LENGTH.unpack_from(self._buffer, 5)[0]
            if not self._plausible(length):
                self._discard(1)
                continue
            end = _PREFIX_BYTES + length
            if len(self._buffer) < end:
                return None
            frame = bytes(self._buffer[:end])
            if crc16(frame[:-_CRC_BYTES]) == _LENGTH.unpack_from(frame, end - _CRC_BYTES)[0]:
                del self._buffer[:end]
                return frame
            self.crc_errors += 1
            self._discard(1)
        return None

    def _seek_header(self) -> bool:
        """Drop bytes before the next header; True when its id and length are there too."""
        start = self._buffer.find(HEADER)
        if start < 0:
            self._discard(max(0, len(self._buffer) - self._header_start_at_end()))
            return False
        self._discard(start)
        return len(self._buffer) >= _PREFIX_BYTES

    def _header_start_at_end(self) -> int:
        """Return how many bytes at the end may be the start of a header."""
        return next((n for n in (3, 2, 1) if self._buffer.endswith(HEADER[:n])), 0)

    def _plausible(self, length: int) -> bool:
        servo_id = self._buffer[4]
        return 3 <= length <= MAX_LENGTH and (servo_id <= MAX_SERVO_ID or servo_id == BROADCAST_ID)
