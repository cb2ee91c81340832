"""Match and decode the reply to a block read with a handful of calls.

The usual reply has a known length and known headers. Anything else - byte stuffing is an everyday
event here, see `ReplyCollector` - takes the slow path to the same values.

After a wait the caches are cold. Then a call of numpy costs ten times what it does in a loop, and
`struct` with plain numbers is the faster way for the few servos that a bus has.
"""

import struct
from collections.abc import Sequence
from typing import Final

from drivers.dynamixel.codec import BROADCAST_ID, HEADER, Instruction, crc16
from drivers.dynamixel.layout import Block
from drivers.dynamixel.sync_read import STATUS_OVERHEAD_BYTES, Entry, SyncRead

_CODES: Final = {1: "B", 2: "H", 4: "I"}
"""The struct code of an unsigned value by its bytes; a signed one has the small letter."""
_FAST_OVERHEAD_BYTES: Final = 4

Columns = dict[str, tuple[int, ...]]
"""Raw values by the names of the block's fields, in the order of the servos."""


class BlockRead:
    """Hold the request for one block of many servos, and the exact look of its usual reply.

    `columns` and `errors`, the status packets' error bytes, are those of the last reply taken.
    """

    def __init__(self, ids: Sequence[int], block: Block, *, fast: bool) -> None:
        self.block = block
        self.fast = fast
        self.sync_read = SyncRead(ids, block.address, block.size, fast=fast)
        self.columns: Columns = {}
        self.errors: tuple[int, ...] = ()
        names = sorted(block.fields, key=lambda name: block.fields[name].start)
        codes = "".join(_code(block, name) for name in names)
        self._names = names
        self._one = struct.Struct("<" + codes)
        self._stride = len(names) + 3  # error, id or head, fields, CRC
        if fast:
            self._all = struct.Struct("<8x" + f"BB{codes}H" * len(ids))
            self._keys: tuple[object, ...] = tuple(ids)
            self._key, self._error = 1, 0
            self._head = _head(BROADCAST_ID, len(ids) * (block.size + _FAST_OVERHEAD_BYTES) + 1)
            self._checked = [slice(0, -2)]
            self._crcs = slice(-1, None)
        else:
            self._all = struct.Struct("<" + f"8sB{codes}H" * len(ids))
            self._keys = tuple(_head(servo_id, block.size + 4) for servo_id in ids)
            self._key, self._error = 0, 1
            self._head = HEADER
            size = block.size + STATUS_OVERHEAD_BYTES
            self._checked = [slice(n * size, (n + 1) * size - 2) for n in range(len(ids))]
            self._crcs = slice(self._stride - 1, None, self._stride)

    def take(self, reply: bytes) -> bool:
        """Decode a reply and tell so, unless it is not exactly the usual one."""
        if len(reply) != self.sync_read.reply_bytes or not reply.startswith(self._head):
            return False
        values, stride = self._all.unpack(reply), self._stride
        if values[self._key :: stride] != self._keys:
            return False
        # in a fast reply the last CRC covers all that comes before, the other servos' CRCs too
        if [crc16(reply[part]) for part in self._checked] != list(values[self._crcs]):
            return False
        self.errors = values[self._error :: stride]
        self.columns = {
            name: values[place::stride] for place, name in enumerate(self._names, start=2)
        }
        return True

    def decode(self, entries: Sequence[Entry]) -> tuple[Columns, tuple[int, ...]]:
        """Return the columns and error bytes of re-framed entries."""
        rows = [self._one.unpack(entry.data) for entry in entries]
        columns = dict(zip(self._names, zip(*rows, strict=True), strict=True)) if rows else {}
        return columns, tuple(entry.error for entry in entries)


def _code(block: Block, name: str) -> str:
    field = block.fields[name]
    return _CODES[field.size].lower() if field.signed else _CODES[field.size]


def _head(servo_id: int, length: int) -> bytes:
    return HEADER + bytes((servo_id, length & 0xFF, length >> 8, Instruction.STATUS))
