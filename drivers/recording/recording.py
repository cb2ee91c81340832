"""Define the file of a wire recording, and read it.

A recording is the magic `VLAWIRE1` and then records, little-endian, each complete in itself:

    kind u8 | length u16 | stamp_ns u64 | crc32 u32 | payload of `length` bytes

The CRC covers kind, length, stamp and payload. The stamp is monotonic nanoseconds of the run's
clock. What follows the last whole record, as after a crash in the middle of a write, is left out.

A CAN payload is that of SocketCAN: id u32 (bit 31 extended, 30 remote, 29 error), flags u8 (bit 0
FD, 1 bit rate switch, 2 error state), dlc u8, data.
"""

import struct
import zlib
from collections.abc import Iterator
from dataclasses import dataclass
from enum import IntEnum
from pathlib import Path
from typing import Final

import can

from drivers.clock import NS_PER_S
from drivers.errors import DeviceMissing, ProtocolError

MAGIC: Final = b"VLAWIRE1"
HEAD: Final = struct.Struct("<BHQI")
_CHECKED: Final = struct.Struct("<BHQ")
_CAN: Final = struct.Struct("<IBB")
_EXTENDED, _REMOTE, _ERROR = 1 << 31, 1 << 30, 1 << 29
_ID_MASK: Final = (1 << 29) - 1
_FD, _RATE_SWITCH, _ERROR_STATE = 1, 2, 4
MAX_PAYLOAD_BYTES: Final = 0xFFFF


class RecordKind(IntEnum):
    """Name what a record holds."""

    NOTE = 1
    """Text about the recording: what was opened, at which speed."""
    WRITE = 2
    READ = 3
    LOST = 4
    """The link was lost here; the payload is the message."""
    CAN_SENT = 5
    CAN_RECEIVED = 6


@dataclass(frozen=True, slots=True)
class WireRecord:
    """Hold one thing that happened on a wire."""

    kind: RecordKind
    stamp_ns: int
    payload: bytes

    def __str__(self) -> str:
        what = self.kind.name.lower().replace("_", " ")
        is_text = self.kind in (RecordKind.NOTE, RecordKind.LOST)
        payload = self.payload.decode(errors="replace") if is_text else self.payload.hex(" ")
        return f"{self.stamp_ns / NS_PER_S:.6f} s {what}: {payload}"


def encode_record(kind: RecordKind, stamp_ns: int, payload: bytes) -> bytes:
    """Return a record as it stands in the file.

    Raises:
        ValueError: the payload is longer than a record can hold.
    """
    if len(payload) > MAX_PAYLOAD_BYTES:
        raise ValueError(f"a wire record holds 0..{MAX_PAYLOAD_BYTES} bytes, got {len(payload)}")
    checked = _CHECKED.pack(kind, len(payload), stamp_ns)
    return checked + zlib.crc32(payload, zlib.crc32(checked)).to_bytes(4, "little") + payload


def read_recording(path: Path) -> list[WireRecord]:
    """Return the records of a recording, those of its older part (`<path>.1`) first.

    Raises:
        DeviceMissing: the file is not there or cannot be read.
        ProtocolError: it is not a recording.
    """
    older = older_part(path)
    parts = [older, path] if older.exists() else [path]
    return [record for part in parts for record in _records(part)]


def older_part(path: Path) -> Path:
    """Return where the older part of a recording that outgrew its bound is kept."""
    return path.with_name(path.name + ".1")


def _records(path: Path) -> Iterator[WireRecord]:
    try:
        content = path.read_bytes()
    except OSError as error:
        raise DeviceMissing(f"{path}: {error.strerror}; name a wire recording") from error
    if not content.startswith(MAGIC):
        raise ProtocolError(
            f"{path}: not a wire recording: expected {MAGIC!r} at its start, got {content[:8]!r}"
        )
    at = len(MAGIC)
    while (record := _record_at(content, at)) is not None:
        yield record
        at += HEAD.size + len(record.payload)


def _record_at(content: bytes, at: int) -> WireRecord | None:
    if at + HEAD.size > len(content):
        return None
    kind, length, stamp_ns, crc = HEAD.unpack_from(content, at)
    payload = content[at + HEAD.size : at + HEAD.size + length]
    checked = content[at : at + _CHECKED.size]
    if len(payload) < length or zlib.crc32(payload, zlib.crc32(checked)) != crc:
        return None
    return WireRecord(RecordKind(kind), stamp_ns, payload)


def encode_can(message: can.Message) -> bytes:
    """Return the payload of a CAN frame."""
    frame_id = (
        message.arbitration_id
        | _EXTENDED * message.is_extended_id
        | _REMOTE * message.is_remote_frame
        | _ERROR * message.is_error_frame
    )
    flags = (
        _FD * message.is_fd
        | _RATE_SWITCH * message.bitrate_switch
        | _ERROR_STATE * message.error_state_indicator
    )
    return _CAN.pack(frame_id, flags, message.dlc) + bytes(message.data)


def decode_can(record: WireRecord) -> can.Message:
    """Return the frame of a CAN record, stamped with seconds of the recording's clock.

    Raises:
        ProtocolError: the record holds no CAN frame.
    """
    is_can = record.kind in (RecordKind.CAN_SENT, RecordKind.CAN_RECEIVED)
    if not is_can or len(record.payload) < _CAN.size:
        raise ProtocolError(f"expected a CAN frame, got {record}")
    frame_id, flags, dlc = _CAN.unpack_from(record.payload)
    return can.Message(
        timestamp=record.stamp_ns / NS_PER_S,
        arbitration_id=frame_id & _ID_MASK,
        is_extended_id=bool(frame_id & _EXTENDED),
        is_remote_frame=bool(frame_id & _REMOTE),
        is_error_frame=bool(frame_id & _ERROR),
        is_fd=bool(flags & _FD),
        bitrate_switch=bool(flags & _RATE_SWITCH),
        error_state_indicator=bool(flags & _ERROR_STATE),
        is_rx=record.kind is RecordKind.CAN_RECEIVED,
        dlc=dlc,
        data=record.payload[_CAN.size :],
    )
