"""Hold the control tables of all servos on one bus in one block of bytes.

The wire sees a servo's row, the control loop sees a register of all servos as one numpy column.
Both are views of the same memory, so nothing is ever copied between them.
"""

from collections.abc import Iterable, Sequence
from typing import Final

import numpy as np
from numpy.typing import DTypeLike, NDArray

from sim_twin.servos.protocol.indirect import Scattered, scatter
from sim_twin.servos.protocol.registers import ControlTable
from sim_twin.servos.spec import EmulatedServoSpec

TABLE_BYTES: Final = 704
LOWEST_SLOT: Final = 208
"""No model has indirect data below."""
_SCATTERED_KEPT: Final = 64


class RegisterFile:
    """Hold the tables of all servos on a bus in one block of memory."""

    def __init__(self, specs: Sequence[EmulatedServoSpec]) -> None:
        self._bytes = bytearray(len(specs) * TABLE_BYTES)
        self._scattered: dict[tuple[int, int, bytes], Scattered] = {}
        view = memoryview(self._bytes)
        self._grid = np.frombuffer(self._bytes, np.uint8).reshape(len(specs), TABLE_BYTES)
        self.tables = tuple(
            ControlTable(
                spec, view[row * TABLE_BYTES : (row + 1) * TABLE_BYTES], self._scattered.clear
            )
            for row, spec in enumerate(specs)
        )
        self._shortest = min(table.end for table in self.tables)

    def __len__(self) -> int:
        return len(self.tables)

    def spans(self, rows: Sequence[int], address: int, length: int) -> list[bytes]:
        """Return the same bytes of several tables; none where one of them would refuse the read."""
        if length == 0 or address + length > self._shortest:
            return []
        scattered = self._scatter(rows, address, length)
        if scattered is None:
            block = self._grid[rows, address : address + length].tobytes()
        else:
            block = self._grid[scattered.index].tobytes()
        return [block[start : start + length] for start in range(0, len(block), length)]

    def sources(
        self, rows: Iterable[int], address: int, length: int
    ) -> tuple[tuple[int, int], ...]:
        """Return the ranges, start and length, where a read of these tables finds its bytes."""
        if address + length <= LOWEST_SLOT:
            return ((address, length),)
        scattered = self._scatter(list(rows), address, length)
        return ((address, length),) if scattered is None else scattered.sources

    def _scatter(self, rows: Sequence[int], address: int, length: int) -> Scattered | None:
        """Return where the bytes of a read are; None where all of them are where it says."""
        if address + length <= LOWEST_SLOT or address + length > TABLE_BYTES:
            return None
        key = address, length, bytes(rows)
        if key not in self._scattered:
            if len(self._scattered) >= _SCATTERED_KEPT:
                self._scattered.clear()
            straight = range(address, address + length)
            targets = [self.tables[row].targets(address, length) or straight for row in rows]
            self._scattered[key] = scatter(rows, targets)
        return self._scattered[key]

    def column(self, address: int, dtype: DTypeLike) -> NDArray[np.int32]:
        """Return the register at `address` of all servos as one writable array."""
        size = np.dtype(dtype).itemsize
        return self._grid[:, address : address + size].view(dtype)[:, 0]
