"""Hold the control tables of all FEETECH servos on one bus, byte by byte as the wire sees them.

The firmware sees a register of all servos as one numpy array, whatever address, byte order and sign
it has in each of them. A register that a model lacks lies beyond what an address of one byte
reaches, and has a value that does nothing there.

Chosen, because no source says it: a write with lock = 1 counts until power is lost; a read finds
zeros where no register is; a write may hold half a register; a write of an id, a mode or a torque
switch that does not exist is ignored, as one of a read-only register is.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from drivers.feetech.codec import FEETECH_MAX_ID, MAX_PARAMS
from drivers.feetech.table import FEETECH_MODELS, FeetechMode, FeetechRegister, TorqueSwitch
from sim_twin.servos.feetech.spec import EmulatedFeetechSpec

SENSED: Final = (range(56, 64), range(66, 71))
"""Addresses of what a servo senses, present position to present current."""
_HOST_BYTES: Final = 256
_ROW_BYTES: Final = 512
_NO_BYTE: Final = _ROW_BYTES - 1
"""Where the high byte of a register of one byte is: always zero."""
_ALLOWED: Final[Mapping[str, frozenset[int]]] = {
    "id": frozenset(range(FEETECH_MAX_ID + 1)),
    "operating_mode": frozenset(FeetechMode),
    "torque_enable": frozenset(TorqueSwitch),
}
_IF_ABSENT: Final = {"protection_current": 0}
"""What a model without the register does as if it had; else the factory value of the others."""


@dataclass(frozen=True, slots=True)
class _Column:
    """Say where the bytes of one register are in each servo, and how it counts."""

    low: NDArray[np.intp]
    high: NDArray[np.intp]
    sign: NDArray[np.int64]
    minimum: NDArray[np.int64]
    maximum: NDArray[np.int64]


def _all_registers() -> dict[str, FeetechRegister]:
    merged: dict[str, FeetechRegister] = {}
    for sheet in FEETECH_MODELS.values():
        merged = {**sheet.registers, **merged}
    return merged


def _layout(registers: Mapping[str, FeetechRegister]) -> dict[str, FeetechRegister]:
    """Return a model's registers, and those it lacks at addresses that no host reaches."""
    layout, free = dict(registers), _HOST_BYTES
    for name, register in _all_registers().items():
        if name not in layout:
            initial = _IF_ABSENT.get(name, register.initial)
            layout[name] = replace(register, address=free, initial=initial)
            free += register.size
    return layout


class FeetechMemory:
    """Hold RAM and EEPROM of all servos on a bus."""

    def __init__(self, specs: Sequence[EmulatedFeetechSpec]) -> None:
        self.sheets = [spec.datasheet for spec in specs]
        self._layouts = [_layout(sheet.registers) for sheet in self.sheets]
        self._owners = [
            {
                each.address + offset: each
                for each in layout.values()
                if each.address < _HOST_BYTES
                for offset in range(each.size)
            }
            for layout in self._layouts
        ]
        self._bytes = np.zeros((len(specs), _ROW_BYTES), np.uint8)
        self._flat = self._bytes.reshape(-1)
        for row, sheet in enumerate(self.sheets):
            for name, register in self._layouts[row].items():
                self.put(row, name, register.initial)
            self.put(row, "model_number", sheet.number)
        self._restorable = self._bytes.copy()
        for row, spec in enumerate(specs):
            for name, value in {**spec.eeprom, "id": spec.id}.items():
                self.put(row, name, value)
        self._kept = self._bytes.copy()
        self._columns = {name: self._column(name) for name in self._layouts[0]}
        for row in range(len(specs)):
            self.power_on(row)

    def __len__(self) -> int:
        return len(self.sheets)

    def get(self, row: int, name: str) -> int:
        """Return a register of one servo."""
        register = self._layouts[row][name]
        end = register.address + register.size
        return register.from_bytes(self._bytes[row, register.address : end].tobytes())

    def put(self, row: int, name: str, value: int) -> None:
        """Set a register of one servo from inside the firmware, until power is lost."""
        register = self._layouts[row][name]
        data = register.to_bytes(value)
        self._bytes[row, register.address : register.address + register.size] = list(data)

    def keep(self, row: int, name: str) -> None:
        """Store a register's value for good."""
        register = self._layouts[row][name]
        span = slice(register.address, register.address + register.size)
        self._kept[row, span] = self._bytes[row, span]

    def column(self, name: str) -> NDArray[np.int64]:
        """Return a register of all servos."""
        place = self._columns[name]
        raw = self._flat[place.low] | self._flat[place.high].astype(np.int64) << 8
        magnitude = raw & (place.sign - 1)  # without a sign bit: all bits
        return np.where(raw & place.sign, -magnitude, magnitude)

    def put_column(self, name: str, values: ArrayLike) -> None:
        """Set a register of all servos, as far as its range goes."""
        place = self._columns[name]
        whole = np.clip(np.rint(values), place.minimum, place.maximum).astype(np.int64)
        raw = np.where(whole < 0, place.sign - whole, whole)
        self._flat[place.low] = raw & 0xFF
        self._flat[place.high] = raw >> 8

    def read(self, row: int, address: int, count: int) -> bytes | None:
        """Return what a host's read finds; None where a servo does not answer it."""
        if not 0 < count <= MAX_PARAMS or address + count > _HOST_BYTES:
            return None
        return self._bytes[row, address : address + count].tobytes()

    def write(self, row: int, address: int, data: bytes) -> list[str]:
        """Carry out a host's write; return the registers that it has set."""
        unlocked = self.get(row, "lock") == 0
        written: list[str] = []
        before = self._bytes[row].copy()
        for where, byte in enumerate(data, start=address):
            register = self._owners[row].get(where)
            if register is not None and register.access == "rw":
                self._bytes[row, where] = byte
                if register.name not in written:
                    written.append(register.name)
        for name in [name for name in written if not self._is_allowed(row, name)]:
            register = self._layouts[row][name]
            self._bytes[row, register.address] = before[register.address]
            written.remove(name)
        for name in written:
            if unlocked and self._layouts[row][name].eeprom:
                self.keep(row, name)
        return written

    def power_on(self, row: int) -> None:
        """Give the RAM its initial values and the EEPROM what was kept."""
        self._bytes[row] = self._kept[row]
        self.put(row, "torque_limit", self.get(row, "max_torque_limit"))

    def back_up(self, row: int) -> None:
        """Keep the table as the one that `restore` brings back."""
        self._restorable[row] = self._bytes[row]

    def restore(self, row: int) -> None:
        """Give the EEPROM, but for the id, its backup or else the factory's values, for good."""
        for name, register in self._layouts[row].items():
            if register.eeprom and register.access == "rw" and name != "id":
                span = slice(register.address, register.address + register.size)
                self._bytes[row, span] = self._restorable[row, span]
                self.keep(row, name)

    def _is_allowed(self, row: int, name: str) -> bool:
        return name not in _ALLOWED or self.get(row, name) in _ALLOWED[name]

    def _column(self, name: str) -> _Column:
        layouts = [layout[name] for layout in self._layouts]
        low, high, sign = [], [], []
        for row, each in enumerate(layouts):
            first = row * _ROW_BYTES + each.address
            last = first + 1 if each.size == 2 else row * _ROW_BYTES + _NO_BYTE
            swapped = each.byte_order == "big" and each.size == 2
            low.append(last if swapped else first)
            high.append(first if swapped else last)
            sign.append(0 if each.sign_bit is None else 1 << each.sign_bit)
        return _Column(
            low=np.array(low),
            high=np.array(high),
            sign=np.array(sign),
            minimum=np.array([each.minimum for each in layouts]),
            maximum=np.array([each.maximum for each in layouts]),
        )
