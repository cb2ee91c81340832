"""Read current (or load), velocity and position of many servos in one transaction, fast.

The three registers are one block, 126..135. The usual reply has a known length and known headers;
it is checked and decoded with a handful of array operations. Anything else - byte stuffing is an
everyday event here, see `ReplyCollector` - takes the slow path to the same records.
"""

from collections.abc import Mapping, Sequence
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from drivers.dynamixel.codec import HEADER, Instruction, crc16
from drivers.dynamixel.sync_read import Entry, SyncRead

BLOCK_ADDRESS: Final = 126
BLOCK_BYTES: Final = 10
_VALUES: Final[list[tuple[str, str]]] = [
    ("error", "u1"),
    ("effort", "<i2"),
    ("velocity", "<i4"),
    ("position", "<i4"),
]
RECORD: Final = np.dtype(_VALUES)
_STATUS_RECORD: Final = np.dtype([("head", "<u8"), *_VALUES, ("crc", "<u2")])
_FAST_RECORD: Final = np.dtype(
    [("error", "u1"), ("id", "u1"), *_VALUES[1:], ("crc", "<u2")],
)
_FAST_HEAD_BYTES: Final = 8
_STATUS_LENGTH: Final = BLOCK_BYTES + 4

Records = NDArray[np.void]


class BlockRead:
    """Hold the request for the block and the exact look of its usual reply."""

    def __init__(self, ids: Sequence[int], *, fast: bool) -> None:
        self.sync_read = SyncRead(ids, BLOCK_ADDRESS, BLOCK_BYTES, fast=fast)
        self._fast = fast
        self._ids = np.array(ids, dtype=np.uint8)
        heads = b"".join(_status_head(servo_id) for servo_id in ids)
        self._heads: NDArray[Any] = np.frombuffer(heads, dtype="<u8")
        size = _STATUS_RECORD.itemsize
        self._slices = [slice(n * size, (n + 1) * size - 2) for n in range(len(ids))]
        length = len(ids) * (BLOCK_BYTES + 4) + 1
        self._fast_head = HEADER + bytes((254, length & 0xFF, length >> 8, Instruction.STATUS))

    def match(self, reply: bytes) -> Records | None:
        """Return one record per servo, or None unless the reply is exactly the usual one."""
        if len(reply) != self.sync_read.reply_bytes:
            return None
        return self._match_fast(reply) if self._fast else self._match_each(reply)

    def _match_each(self, reply: bytes) -> Records | None:
        records = np.frombuffer(reply, dtype=_STATUS_RECORD)
        if not (records["head"] == self._heads).all():
            return None
        if [crc16(reply[part]) for part in self._slices] != records["crc"].tolist():
            return None
        return records

    def _match_fast(self, reply: bytes) -> Records | None:
        if not reply.startswith(self._fast_head):
            return None
        records = np.frombuffer(reply, dtype=_FAST_RECORD, offset=_FAST_HEAD_BYTES)
        if not (records["id"] == self._ids).all():
            return None
        if crc16(reply[:-2]) != records["crc"][-1]:  # covers the CRCs of all servos before
            return None
        return records


def _status_head(servo_id: int) -> bytes:
    return HEADER + bytes((servo_id, _STATUS_LENGTH, 0, Instruction.STATUS))


def records_of(entries: Mapping[int, Entry], ids: Sequence[int]) -> Records:
    """Return the records of the given servos from re-framed entries."""
    rows = [bytes((entries[servo_id].error,)) + entries[servo_id].data for servo_id in ids]
    return np.frombuffer(b"".join(rows), dtype=RECORD)
