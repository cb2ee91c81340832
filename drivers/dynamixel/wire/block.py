"""Match and decode the reply to a block read with a handful of calls.

The usual reply has a known length and known headers. Anything else - byte stuffing is an everyday
event here, see `ReplyCollector` - takes the slow path to the same values.

After a wait the caches are cold, and then a call costs several times what it does in a loop. So a
reply is copied over the one before, and all views of it are made once: its headers are compared by
one call, its CRCs by another, and `columns` hand out the fields as they lie there.
"""

import struct
from collections.abc import Sequence
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from drivers.dynamixel.tables.layout import Block, Field
from drivers.dynamixel.wire.codec import crc16, encode_fast_status, encode_status
from drivers.dynamixel.wire.sync_read import STATUS_OVERHEAD_BYTES, Entry, SyncRead

_HEAD_BYTES: Final = 8
"""Header, id, length and instruction; in a plain reply each servo sends them."""
_CRC_BYTES: Final = 2
_FAST_OVERHEAD_BYTES: Final = 4

Columns = NDArray[Any]
"""Raw values: a row per field, in it a value per servo."""


class BlockRead:
    """Hold the request for one block of many servos, and the exact look of its usual reply.

    `errors` are the status packets' error bytes in the reply taken last.
    """

    def __init__(self, ids: Sequence[int], block: Block, *, fast: bool) -> None:
        self.block = block
        self.fast = fast
        self.sync_read = SyncRead(ids, block.address, block.size, fast=fast)
        self._count = count = len(ids)
        self._reply_bytes = total = self.sync_read.reply_bytes
        self._buffer = bytearray(total)
        self.errors = b""
        view = memoryview(self._buffer)
        if fast:
            self._stride = stride = block.size + _FAST_OVERHEAD_BYTES
            self._data_at = _HEAD_BYTES + 2
            heads, crcs = "<Q" + f"xB{stride - 2}x" * count, f"<{total - _CRC_BYTES}xH"
            # the last CRC covers all that comes before, the other servos' CRCs too
            self._checked = [view[:-_CRC_BYTES]]
            usual = encode_fast_status([(0, id_, bytes(block.size)) for id_ in ids])
        else:
            self._stride = stride = block.size + STATUS_OVERHEAD_BYTES
            self._data_at = _HEAD_BYTES + 1
            heads, crcs = "<" + f"Q{stride - _HEAD_BYTES}x" * count, "<" + f"{stride - 2}xH" * count
            ends = range(stride, total + 1, stride)
            self._checked = [view[end - stride : end - _CRC_BYTES] for end in ends]
            usual = b"".join(encode_status(id_, 0, bytes(block.size)) for id_ in ids)
        self._errors = slice(_HEAD_BYTES, None, stride)
        self._heads_of = struct.Struct(heads).unpack_from
        self._crcs_of = struct.Struct(crcs).unpack_from
        self._usual_heads = self._heads_of(usual)

    def take(self, reply: bytes) -> bool:
        """Keep a reply and tell so, unless it is not exactly the usual one."""
        if len(reply) != self._reply_bytes:
            return False
        buffer = self._buffer
        buffer[:] = reply
        if self._heads_of(buffer) != self._usual_heads:
            return False
        if tuple(map(crc16, self._checked)) != self._crcs_of(buffer):
            return False
        self.errors = reply[self._errors]
        return True

    def columns(self, names: Sequence[str]) -> Columns:
        """Return a view of fields of one type at equal distances, in the reply taken last."""
        fields = [self.block.fields[name] for name in names]
        return np.ndarray(
            (len(names), self._count),
            _dtype(fields[0]),
            self._buffer,
            self._data_at + fields[0].start,
            (fields[-1].start - fields[-2].start if len(fields) > 1 else 0, self._stride),
        )


def decode(field: Field, entries: Sequence[Entry]) -> list[int]:
    """Return a field's raw values in re-framed entries."""
    place = slice(field.start, field.start + field.size)
    return [int.from_bytes(entry.data[place], "little", signed=field.signed) for entry in entries]


def _dtype(field: Field) -> str:
    return f"<{'i' if field.signed else 'u'}{field.size}"
