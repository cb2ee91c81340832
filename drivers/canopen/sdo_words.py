"""Put SDO frames into words (CiA 301)."""

from drivers.canopen.sdo import (
    ABORTED,
    DOWNLOADED,
    EXPEDITED,
    FRAME_BYTES,
    LAST,
    SEGMENT_BYTES,
    SIZED,
    SPECIFIER,
    START_DOWNLOAD,
    START_UPLOAD,
    UPLOAD_SEGMENT,
    UPLOADED,
)
from drivers.canopen.sdo_abort import ABORT_TEXTS
from drivers.errors import ProtocolError


def describe_sdo_request(data: bytes) -> str:
    """Return a request in words.

    Raises:
        ProtocolError: it is not eight bytes long.
    """
    specifier = _specifier(data)
    if specifier == START_UPLOAD:
        return f"read {_object(data)}"
    if specifier == START_DOWNLOAD:
        return f"write {_object(data)} = {_payload(data)}"
    if specifier == UPLOAD_SEGMENT:
        return "read the next segment"
    if specifier == 0:
        return f"write segment {_segment(data)}"
    return _abort_or_other(data)


def describe_sdo_reply(data: bytes) -> str:
    """Return a reply in words.

    Raises:
        ProtocolError: it is not eight bytes long.
    """
    specifier = _specifier(data)
    if specifier == UPLOADED:
        return f"{_object(data)} = {_payload(data)}"
    if specifier == DOWNLOADED:
        return f"{_object(data)} written"
    if specifier == START_DOWNLOAD:
        return "segment taken"
    if specifier == 0:
        return f"segment {_segment(data)}"
    return _abort_or_other(data)


def _specifier(data: bytes) -> int:
    if len(data) != FRAME_BYTES:
        raise ProtocolError(f"SDO frame has {len(data)} bytes, expected {FRAME_BYTES}")
    return data[0] & SPECIFIER


def _object(data: bytes) -> str:
    return f"0x{int.from_bytes(data[1:3], 'little'):04X}:{data[3]:X}"


def _payload(data: bytes) -> str:
    if not data[0] & EXPEDITED:
        return f"{int.from_bytes(data[4:8], 'little')} bytes in segments"
    size = 4 - (data[0] >> 2 & 3) if data[0] & SIZED else 4
    value = data[4 : 4 + size]
    return f"{value.hex(' ')} ({int.from_bytes(value, 'little')})"


def _segment(data: bytes) -> str:
    size = SEGMENT_BYTES - (data[0] >> 1 & 7)
    return f"{data[1 : 1 + size].hex(' ')}{', the last' if data[0] & LAST else ''}"


def _abort_or_other(data: bytes) -> str:
    if data[0] & SPECIFIER != ABORTED:
        return f"command 0x{data[0]:02X}"
    code = int.from_bytes(data[4:8], "little")
    reason = ABORT_TEXTS.get(code, "an abort code outside CiA 301")
    return f"{_object(data)} aborted with 0x{code:08X}, {reason}"
