"""Match and decode the reply to a block read with a handful of calls.

The usual reply has a known length and known headers. Anything else - byte stuffing is an everyday
event here, see `ReplyCollector` - takes the slow path to the same values.
"""

import struct
from collections.abc import Mapping, Sequence
from typing import Final

import numpy as np
from numpy.typing import NDArray

from drivers.dynamixel.codec import BROADCAST_ID, HEADER, Instruction, crc16
from drivers.dynamixel.layout import CLIMATE, MOTION, STATUS, Block, Field
from drivers.dynamixel.sync_read import Entry, SyncRead

_FAST_HEAD_BYTES: Final = 8
_STATUS_HEAD_BYTES: Final = 9  # header .. error
_FAST_STRIDE_OVERHEAD: Final = 4
_STATUS_STRIDE_OVERHEAD: Final = 11

Raw = NDArray[np.int32]


class BlockRead:
    """Hold the request for one block of many servos, and the exact look of its usual reply.

    `raw` has a row for each of `MOTION` (and of `CLIMATE` where the block has them) and a column
    for each servo; `status` has a byte string for each of `STATUS`; `errors` the status packets'
    error bytes; `voltage_low` the low bytes of the voltage. All are of the last reply taken.
    Headers and CRCs are compared as bytes: after a wait the caches are cold, and then each numpy
    call costs several times what it does in a loop.
    """

    def __init__(self, ids: Sequence[int], block: Block, *, fast: bool) -> None:
        self.block = block
        self.fast = fast
        self.ids = tuple(ids)
        self.sync_read = SyncRead(ids, block.address, block.size, fast=fast)
        self.rows = MOTION + CLIMATE if "voltage" in block.fields else MOTION
        self.errors = b""
        self.status: tuple[bytes, ...] = ()
        self.voltage_low = b""
        if fast:
            start, stride = _FAST_HEAD_BYTES + 2, block.size + _FAST_STRIDE_OVERHEAD
            self._error_bytes = slice(_FAST_HEAD_BYTES, None, stride)
        else:
            start, stride = _STATUS_HEAD_BYTES, block.size + _STATUS_STRIDE_OVERHEAD
            self._error_bytes = slice(_STATUS_HEAD_BYTES - 1, None, stride)
        self._picture = _Picture(len(ids), block, self.rows, start, stride)
        self.raw = self._picture.raw
        self._ids = bytes(ids)
        self._id_bytes = slice(_FAST_HEAD_BYTES + 1, None, stride)
        self._heads = tuple(_status_head(servo_id, block.size) for servo_id in ids)
        self._heads_and_crcs = struct.Struct("<" + f"8s{block.size + 1}xH" * len(ids))
        self._checked = [slice(n * stride, (n + 1) * stride - 2) for n in range(len(ids))]
        length = len(ids) * (block.size + _FAST_STRIDE_OVERHEAD) + 1
        self._fast_head = HEADER + bytes(
            (BROADCAST_ID, length & 0xFF, length >> 8, Instruction.STATUS)
        )

    def take(self, reply: bytes) -> bool:
        """Decode a reply and tell so, unless it is not exactly the usual one."""
        if len(reply) != self.sync_read.reply_bytes:
            return False
        if not (self._is_fast(reply) if self.fast else self._is_each(reply)):
            return False
        self._picture.take(reply)
        self.errors = reply[self._error_bytes]
        self.status = tuple([reply[part] for part in self._picture.status])
        self.voltage_low = reply[self._picture.voltage_low]
        return True

    def decode(
        self, entries: Mapping[int, Entry], ids: Sequence[int]
    ) -> tuple[Raw, bytes, tuple[bytes, ...]]:
        """Return raw values, error bytes and status of re-framed entries of some servos."""
        picture = _Picture(len(ids), self.block, self.rows, 0, self.block.size)
        data = b"".join([entries[servo_id].data for servo_id in ids])
        picture.take(data)
        errors = bytes([entries[servo_id].error for servo_id in ids])
        return picture.raw, errors, tuple([data[part] for part in picture.status])

    def _is_each(self, reply: bytes) -> bool:
        heads_and_crcs = self._heads_and_crcs.unpack(reply)
        return heads_and_crcs[0::2] == self._heads and heads_and_crcs[1::2] == tuple(
            [crc16(reply[part]) for part in self._checked]
        )

    def _is_fast(self, reply: bytes) -> bool:
        if not reply.startswith(self._fast_head) or reply[self._id_bytes] != self._ids:
            return False
        # the last CRC covers all that comes before, the CRCs of the other servos included
        return crc16(reply[:-2]) == int.from_bytes(reply[-2:], "little")


class _Picture:
    """Know where each byte of each value lies in a reply; one gather makes integers of them."""

    def __init__(
        self, count: int, block: Block, rows: Sequence[str], start: int, stride: int
    ) -> None:
        total = start + count * stride
        self._bytes = bytearray(total + 1)  # the last byte stays zero
        self._end = total
        self._source = np.frombuffer(self._bytes, np.uint8)
        offsets = start + stride * np.arange(count, dtype=np.intp)
        self._index = np.stack([_byte_places(block.fields[n], offsets, total) for n in rows])
        self._gathered = np.zeros(self._index.shape, np.uint8)
        self.raw: Raw = self._gathered.view("<i4")[:, :, 0]
        places = [block.fields[name].start for name in STATUS if name in block.fields]
        self.status = [slice(start + place, total, stride) for place in places]
        voltage = block.fields.get("voltage")
        self.voltage_low = slice(start + voltage.start, total, stride) if voltage else slice(0, 0)

    def take(self, reply: bytes) -> None:
        self._bytes[: len(reply)] = reply
        self._source.take(self._index, out=self._gathered, mode="clip")


def _byte_places(field: Field, offsets: NDArray[np.intp], zero: int) -> NDArray[np.intp]:
    """Return, per servo, which four bytes of a reply make up a value; `zero` is a zero byte."""
    places = [offsets + field.start + n for n in range(field.size)]
    padding = [np.full(len(offsets), zero, dtype=np.intp)] * (4 - field.size)
    return np.stack(padding + places if field.signed else places + padding, axis=1)


def raw_unit(field: Field) -> float:
    """Return by what a raw value must be multiplied to be the register's."""
    return 1.0 / (1 << 8 * (4 - field.size)) if field.signed else 1.0


def _status_head(servo_id: int, size: int) -> bytes:
    return HEADER + bytes((servo_id, size + 4, 0, Instruction.STATUS))
