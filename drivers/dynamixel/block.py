"""Read current (or load), velocity and position of many servos in one transaction, fast.

The three registers are one block, 126..135. The usual reply has a known length and known headers;
it is checked and decoded with a handful of calls. Anything else - byte stuffing is an
everyday event here, see `ReplyCollector` - takes the slow path to the same records.
"""

import struct
from collections.abc import Mapping, Sequence
from typing import Final

import numpy as np
from numpy.typing import NDArray

from drivers.dynamixel.codec import BROADCAST_ID, HEADER, Instruction, crc16
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
_STATUS_RECORD: Final = np.dtype([("head", "V8"), *_VALUES, ("crc", "<u2")])
_FAST_RECORD: Final = np.dtype([_VALUES[0], ("id", "u1"), *_VALUES[1:], ("crc", "<u2")])
_FAST_HEAD_BYTES: Final = 8
_STATUS_HEAD_AND_CRC: Final = "8s11xH"
_STATUS_LENGTH: Final = BLOCK_BYTES + 4

Records = NDArray[np.void]


class BlockRead:
    """Hold the request for the block and the exact look of its usual reply.

    Headers and CRCs are compared as bytes: after a wait the caches are cold, and then each numpy
    call costs several times what it does in a loop.
    """

    def __init__(self, ids: Sequence[int], *, fast: bool) -> None:
        self.sync_read = SyncRead(ids, BLOCK_ADDRESS, BLOCK_BYTES, fast=fast)
        self._fast = fast
        self._ids = bytes(ids)
        self._heads = tuple(_status_head(servo_id) for servo_id in ids)
        self._heads_and_crcs = struct.Struct("<" + _STATUS_HEAD_AND_CRC * len(ids))
        size = _STATUS_RECORD.itemsize
        self._checked = [slice(n * size, (n + 1) * size - 2) for n in range(len(ids))]
        length = len(ids) * (BLOCK_BYTES + 4) + 1
        self._fast_head = HEADER + bytes(
            (BROADCAST_ID, length & 0xFF, length >> 8, Instruction.STATUS)
        )

    def match(self, reply: bytes) -> Records | None:
        """Return one record per servo, or None unless the reply is exactly the usual one."""
        if len(reply) != self.sync_read.reply_bytes:
            return None
        return self._match_fast(reply) if self._fast else self._match_each(reply)

    def _match_each(self, reply: bytes) -> Records | None:
        heads_and_crcs = self._heads_and_crcs.unpack(reply)
        if heads_and_crcs[0::2] != self._heads:
            return None
        if heads_and_crcs[1::2] != tuple([crc16(reply[part]) for part in self._checked]):
            return None
        return np.frombuffer(reply, dtype=_STATUS_RECORD)

    def _match_fast(self, reply: bytes) -> Records | None:
        ids = reply[_FAST_HEAD_BYTES + 1 :: _FAST_RECORD.itemsize]
        if not reply.startswith(self._fast_head) or ids != self._ids:
            return None
        # the last CRC covers all that comes before, the CRCs of the other servos included
        if crc16(reply[:-2]) != int.from_bytes(reply[-2:], "little"):
            return None
        return np.frombuffer(reply, dtype=_FAST_RECORD, offset=_FAST_HEAD_BYTES)


def _status_head(servo_id: int) -> bytes:
    return HEADER + bytes((servo_id, _STATUS_LENGTH, 0, Instruction.STATUS))


def records_of(entries: Mapping[int, Entry], ids: Sequence[int]) -> Records:
    """Return the records of the given servos from re-framed entries."""
    rows = [bytes((entries[servo_id].error,)) + entries[servo_id].data for servo_id in ids]
    return np.frombuffer(b"".join(rows), dtype=RECORD)
