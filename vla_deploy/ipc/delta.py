"""Write a stream of like records: each carries what has changed, every so often one carries all.

Record: number (4 bytes), length of the table (4), table as JSON (key records only), one bit per
value, then the packed values whose bit is set. A reader that lost a record waits for the next key
record.
"""

import json
import struct
from collections.abc import Sequence
from typing import Any

import numpy as np

from vla_deploy.ipc.errors import BadPayload
from vla_deploy.ipc.packing import Catalogue, Unpacker, array_head

_HEAD = struct.Struct("<II")


class DeltaWriter:
    """Turn rows of values into records.

    An object that is handed in again is taken for unchanged, so values are never altered in place;
    only bare arrays are looked into each time.
    """

    def __init__(self, names: Sequence[str], catalogue: Catalogue, *, key_every: int) -> None:
        table = {"names": list(names), "types": catalogue.document()}
        self._table = json.dumps(table, separators=(",", ":")).encode()
        self._catalogue = catalogue
        self._key_every = key_every
        self._mask_bytes = -(-len(names) // 8)
        self._number = 0
        self._values: list[Any] = [None] * len(names)
        self._packed: list[bytes] = [b""] * len(names)

    def record(self, values: Sequence[Any]) -> bytes:
        """Return the record of one row, in the order of the names.

        Raises:
            BadPayload: a value of a type that the catalogue does not have.
        """
        key = self._number % self._key_every == 0
        mask, body = 0, bytearray()
        for place, value in enumerate(values):
            is_array = type(value) is np.ndarray
            known = value is self._values[place] and not is_array and self._number
            packed = self._packed[place] if known else self._pack(value, is_array)
            if key or packed != self._packed[place]:
                mask |= 1 << place
                body += packed
            self._values[place] = value
            self._packed[place] = packed
        table = self._table if key else b""
        head = _HEAD.pack(self._number, len(table))
        self._number += 1
        return b"".join((head, table, mask.to_bytes(self._mask_bytes, "little"), body))

    def _pack(self, value: Any, is_array: bool) -> bytes:
        if is_array:
            return array_head(value.dtype.str, value.shape) + bytes(value.tobytes())
        return self._catalogue.pack(value)


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
