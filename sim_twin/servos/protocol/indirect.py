"""Follow indirect addresses: registers of slots, and where the bytes of a read really are.

A slot's address register says which byte shows, and can be written, at the slot's data address. A
slot that points at itself, as all do after power-on, is plain memory.

Source: ROBOTIS e-manual XM430-W350, "Indirect Address, Indirect Data".
"""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import cache
from typing import Final

import numpy as np
from numpy.typing import NDArray

from drivers.dynamixel.tables.control_table import Register
from drivers.dynamixel.tables.model import IndirectBank

ADDRESS_PREFIX: Final = "indirect_address_"
_LOWEST_TARGET: Final = 64


@cache
def indirect_registers(banks: tuple[IndirectBank, ...]) -> tuple[Register, ...]:
    """Return the registers of indirect slots, which the models' tables leave out."""
    highest = max((bank.data + bank.slots for bank in banks), default=0) - 1
    slots = [
        (bank.addresses + 2 * slot, bank.data + slot)
        for bank in banks
        for slot in range(bank.slots)
    ]
    addresses = [
        Register(
            f"{ADDRESS_PREFIX}{number}",
            address,
            2,
            "rw",
            False,
            False,
            data,
            _LOWEST_TARGET,
            highest,
        )
        for number, (address, data) in enumerate(slots, start=1)
    ]
    data = [
        Register(f"indirect_data_{number}", address, 1, "rw", False, False, 0, 0, 255)
        for number, (_, address) in enumerate(slots, start=1)
    ]
    return (*addresses, *data)


@dataclass(frozen=True, slots=True)
class Scattered:
    """Hold where a read of several tables finds its bytes; `sources` are starts and lengths."""

    index: tuple[NDArray[np.intp], NDArray[np.intp]]
    sources: tuple[tuple[int, int], ...]


def scatter(rows: Sequence[int], targets: Sequence[Sequence[int]]) -> Scattered:
    """Return the places of bytes that are each at an address of their own, row by row."""
    index = np.array(rows, np.intp)[:, None], np.array(targets, np.intp)
    return Scattered(index, tuple(_ranges({each for one in targets for each in one})))


def _ranges(addresses: Iterable[int]) -> Iterator[tuple[int, int]]:
    """Join addresses to ranges, start and length."""
    start = end = -1
    for address in sorted(addresses):
        if address != end:
            if end > start:
                yield start, end - start
            start = address
        end = address + 1
    if end > start:
        yield start, end - start
