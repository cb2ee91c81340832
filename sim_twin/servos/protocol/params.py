"""Read the params of instructions that address several servos, or one range of one servo."""

import struct
from collections.abc import Callable, Iterator
from typing import Final

from drivers.dynamixel.wire.codec import Instruction, StatusError
from sim_twin.servos.protocol.registers import AccessRefused

_RANGE: Final = struct.Struct("<HH")
_BULK: Final = struct.Struct("<BHH")

Request = tuple[int, int, int]
"""Servo id, address, length."""

GroupWrite = tuple[int, int, bytes]
"""Servo id, address, data."""


def range_of(params: bytes) -> tuple[int, int]:
    """Return the address and length at the start of `params`.

    Raises:
        Refused: `params` is too short.
    """
    if len(params) < _RANGE.size:
        raise AccessRefused(StatusError.DATA_LENGTH)
    address, length = _RANGE.unpack_from(params)
    return address, length


def address_of(params: bytes) -> int:
    """Return the address at the start of `params`.

    Raises:
        Refused: `params` is too short.
    """
    if len(params) < 2:
        raise AccessRefused(StatusError.DATA_LENGTH)
    return int.from_bytes(params[:2], "little")


def _sync_read_requests(params: bytes) -> list[Request]:
    address, length = range_of(params)
    return [(servo_id, address, length) for servo_id in params[_RANGE.size :]]


def _bulk_read_requests(params: bytes) -> list[Request]:
    whole = len(params) // _BULK.size * _BULK.size
    return list(_BULK.iter_unpack(params[:whole]))


def _sync_writes(params: bytes) -> Iterator[GroupWrite]:
    address, length = range_of(params)
    for start in range(_RANGE.size, len(params) - length, length + 1):
        yield params[start], address, params[start + 1 : start + 1 + length]


def _bulk_writes(params: bytes) -> Iterator[GroupWrite]:
    start = 0
    while start + _BULK.size <= len(params):
        servo_id, address, length = _BULK.unpack_from(params, start)
        start += _BULK.size + length
        if start <= len(params):
            yield servo_id, address, params[start - length : start]


READ_REQUESTS: Final[dict[int, Callable[[bytes], list[Request]]]] = {
    Instruction.SYNC_READ: _sync_read_requests,
    Instruction.FAST_SYNC_READ: _sync_read_requests,
    Instruction.BULK_READ: _bulk_read_requests,
    Instruction.FAST_BULK_READ: _bulk_read_requests,
}
"""How each group read names its servos; raises Refused where params are too short."""

GROUP_WRITES: Final[dict[int, Callable[[bytes], Iterator[GroupWrite]]]] = {
    Instruction.SYNC_WRITE: _sync_writes,
    Instruction.BULK_WRITE: _bulk_writes,
}
"""How each group write names its servos and values; raises Refused likewise."""
