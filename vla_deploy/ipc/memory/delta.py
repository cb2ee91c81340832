"""Write a stream of like records: each carries what has changed, every so often one carries all.

Record: number (4 bytes), length of the table (4), table as JSON (key records only), one bit per
value, then the packed values whose bit is set. A reader that lost a record waits for the next key
record.
"""

import json
import struct
from collections.abc import Sequence
from typing import Any, Final

import numpy as np

from vla_deploy.ipc.errors import BadPayload
from vla_deploy.ipc.memory.packing import Catalogue, Unpacker

_HEAD = struct.Struct("<II")
_NOTHING: Final = object()


class DeltaWriter:
    """Turn rows of values into records.

    An object that is handed in again is taken for unchanged, so values are never altered in place;
    only bare arrays are looked into each time.
    """

    def __init__(self, names: Sequence[str], catalogue: Catalogue, *, key_every: int) -> None:
        table = {"names": list(names), "types": catalogue.document()}
        self._table = json.dumps(table, separators=(",", ":")).encode()
        self._pack = catalogue.pack
        self._key_every = key_every
        self._mask_bytes = -(-len(names) // 8)
        self._every_bit = (1 << len(names)) - 1
        self._number = 0
        self._values: list[Any] = [_NOTHING] * len(names)
        self._packed: list[bytes] = [b""] * len(names)
        self._mask = 0
        self._changed: list[bytes] = []

    def put(self, first: int, values: Sequence[Any]) -> None:
        """Take values from the `first` name on, in order; arrays may be altered afterwards.

        Raises:
            BadPayload: a value of a type that the catalogue does not have.
        """
        known, packed, pack = self._values, self._packed, self._pack
        for place, value in enumerate(values, first):
            if value is known[place] and type(value) is not np.ndarray:
                continue
            known[place] = value
            new = pack(value)
            if new != packed[place]:
                packed[place] = new
                self._mask |= 1 << place
                self._changed.append(new)

    def record(self) -> bytes:
        """Return the record of what was put; values that were not are as before."""
        number, mask, body, table = self._number, self._mask, self._changed, b""
        self._number, self._mask, self._changed = number + 1, 0, []
        if number % self._key_every == 0:
            mask, body, table = self._every_bit, self._packed, self._table
        head = _HEAD.pack(number, len(table))
        return b"".join((head, table, mask.to_bytes(self._mask_bytes, "little"), *body))


class DeltaReader:
    """Turn records back into rows."""

    def __init__(self, known: Sequence[type]) -> None:
        self._known = known
        self._names: list[str] = []
        self._values: list[Any] = []
        self._unpacker: Unpacker | None = None
        self._table = b""
        self._next = -1

    def row(self, record: bytes) -> dict[str, Any] | None:
        """Return name and value of one row, or None where a record before it is missing.

        Raises:
            BadPayload: it is no such record, or this version does not know what it carries.
        """
        if len(record) < _HEAD.size:
            raise BadPayload(f"record of {len(record)} bytes, expected at least {_HEAD.size}")
        number, table_bytes = _HEAD.unpack_from(record)
        if table_bytes:
            self._begin(record[_HEAD.size : _HEAD.size + table_bytes])
        elif number != self._next:
            self._next = -1
            return None
        self._next = number + 1
        self._update(record, _HEAD.size + table_bytes)
        return dict(zip(self._names, self._values, strict=True))

    def _begin(self, table: bytes) -> None:
        if table == self._table:
            return
        try:
            document = json.loads(table)
            names, catalogue = document["names"], document["types"]
        except (ValueError, KeyError, TypeError) as error:
            raise BadPayload(f"key record: its table cannot be read: {error}") from error
        self._unpacker = Unpacker(catalogue, self._known)
        self._table, self._names, self._values = table, names, [None] * len(names)

    def _update(self, record: bytes, at: int) -> None:
        unpacker = self._unpacker
        if unpacker is None:
            raise BadPayload("record before any key record")
        size = -(-len(self._names) // 8)
        mask = int.from_bytes(record[at : at + size], "little")
        unpacker.load(record, at + size)
        for place in range(len(self._names)):
            if mask >> place & 1:
                self._values[place] = unpacker.take()
