"""Serve process data as their parameters say: identifiers, transmission types, mapped objects."""

import struct
from collections.abc import Callable
from typing import Final

from drivers.canopen.objects import Pdo
from sim_twin.can.cia402.object_dictionary import NO_OBJECT, VALUE_RANGE, ObjectDictionary, SdoAbort

Key = tuple[int, int]

# CiA 301, SDO abort codes
UNSUPPORTED_ACCESS: Final = 0x06010000
NOT_MAPPABLE: Final = 0x06040041
PDO_TOO_LONG: Final = 0x06040042
PRESENT_STATE: Final = 0x08000022

COB_ID, TRANSMISSION = 1, 2
INVALID_BIT: Final = 1 << 31
IDENTIFIER_MASK: Final = 0x7FF
# Bits 30 to 11: no RTR is answered, only 11-bit identifiers are known.
UNSUPPORTED_BITS: Final = 0x3FFF_F800
LOWEST_FREE_COB: Final = 0x181
MAX_PDO_BITS: Final = 64
LAST_SYNCHRONOUS: Final = 240
EVENT_DRIVEN: Final = (254, 255)


class PdoServer:
    """Hold one PDO's parameters and pack or unpack what is mapped.

    As CiA 301 asks, the mapping can be changed only while the PDO is invalid (bit 31 of its
    identifier), entry by entry while the number of mapped objects is 0.
    """

    def __init__(self, objects: ObjectDictionary, pdo: Pdo, *, transmits: bool) -> None:
        self._objects = objects
        self._communication = pdo.communication
        self._mapping = pdo.mapping
        self._transmits = transmits
        self._syncs = 0
        self.keys: tuple[Key, ...] = ()
        self.cob_id: int | None = None
        self.synchronous = True
        self._every_syncs = 1
        self._readers: list[Callable[[], int]] = []
        self._wire = struct.Struct("")
        self.on_change: Callable[[], None] = lambda: None
        react = objects.on_write
        react[pdo.communication, COB_ID] = self._check_cob_id
        react[pdo.communication, TRANSMISSION] = self._check_transmission
        react[pdo.mapping, 0] = self._check_count
        for row in range(1, objects.highest_subindex(pdo.mapping) + 1):
            react[pdo.mapping, row] = self._check_entry
        for key in [key for key in react if key[0] in (pdo.communication, pdo.mapping)]:
            objects.after_write[key] = self.refresh
        self.refresh()

    @property
    def size(self) -> int:
        """Return the length of the data in bytes."""
        return self._wire.size

    def refresh(self) -> None:
        """Take over the parameters from the object dictionary; no `cob_id` is an invalid PDO."""
        value = self._objects.get(self._communication, COB_ID)
        self.cob_id = None if value & INVALID_BIT else value & IDENTIFIER_MASK
        self._every_syncs = self._objects.get(self._communication, TRANSMISSION)
        self.synchronous = self._every_syncs <= LAST_SYNCHRONOUS
        count = self._objects.get(self._mapping, 0)
        rows = [self._objects.get(self._mapping, row) for row in range(1, count + 1)]
        self.keys = tuple((entry >> 16, entry >> 8 & 0xFF) for entry in rows)
        if not all(map(self._objects.has, self.keys)):
            self.keys, self.cob_id = (), None  # as delivered it maps what this drive does not have
        self._wire = struct.Struct("<" + "".join(map(self._objects.wire_format, self.keys)))
        self._readers = [self._objects.reader(key) for key in self.keys]
        self._syncs = 0
        self.on_change()

    def due_on_sync(self) -> bool:
        """Count a SYNC and tell whether it asks for this PDO."""
        if self.cob_id is None or not self.synchronous:
            return False
        self._syncs += 1
        if self._syncs < self._every_syncs:
            return False
        self._syncs = 0
        return True

    def pack(self) -> bytes:
        """Return the mapped objects' present values."""
        return self._wire.pack(*[read() for read in self._readers])

    def unpack(self, data: bytes) -> dict[Key, int]:
        """Return the values of the mapped objects."""
        return dict(zip(self.keys, self._wire.unpack(data), strict=True))

    def _check_cob_id(self, value: int) -> None:
        identifier = value & IDENTIFIER_MASK
        if value & UNSUPPORTED_BITS or identifier < LOWEST_FREE_COB:
            raise SdoAbort(VALUE_RANGE)
        if not value & INVALID_BIT and self.cob_id not in (None, identifier):
            raise SdoAbort(VALUE_RANGE)

    def _check_transmission(self, value: int) -> None:
        lowest = 1 if self._transmits else 0
        driven = not self._transmits and value in EVENT_DRIVEN
        if not driven and not lowest <= value <= LAST_SYNCHRONOUS:
            raise SdoAbort(VALUE_RANGE)

    def _check_entry(self, _entry: int) -> None:
        self._check_invalid()
        if self._objects.get(self._mapping, 0):
            raise SdoAbort(UNSUPPORTED_ACCESS)

    def _check_count(self, count: int) -> None:
        self._check_invalid()
        bits = 0
        for row in range(1, count + 1):
            bits += self._mapped_bits(self._objects.get(self._mapping, row))
        if bits > MAX_PDO_BITS:
            raise SdoAbort(PDO_TOO_LONG)

    def _check_invalid(self) -> None:
        if self.cob_id is not None:
            raise SdoAbort(PRESENT_STATE)

    def _mapped_bits(self, entry: int) -> int:
        key, bits = (entry >> 16, entry >> 8 & 0xFF), entry & 0xFF
        if not self._objects.has(key):
            raise SdoAbort(NO_OBJECT)
        if not self._objects.mappable(key, bits, transmits=self._transmits):
            raise SdoAbort(NOT_MAPPABLE)
        return bits
