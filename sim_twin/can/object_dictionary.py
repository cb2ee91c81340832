"""Hold the emulated drive's objects, with types, defaults and access rights from the EDS file."""

from collections.abc import Callable
from pathlib import Path
from typing import Any, Final

import canopen

from drivers.canopen.objects import EDS_PATH

# CiA 301, SDO abort codes
WRITE_ONLY: Final = 0x06010001
READ_ONLY: Final = 0x06010002
NO_OBJECT: Final = 0x06020000
WRONG_LENGTH: Final = 0x06070010
NO_SUBINDEX: Final = 0x06090011
VALUE_RANGE: Final = 0x06090030

Key = tuple[int, int]
LAST_COMMUNICATION_INDEX: Final = 0x1FFF


class SdoAbort(Exception):
    """Refuse an SDO access with the standard's abort code."""

    def __init__(self, code: int) -> None:
        super().__init__(f"SDO abort 0x{code:08X}")
        self.code = code


class ObjectDictionary:
    """Read and write objects as numbers inside and as bytes for the SDO server.

    `live` computes an object when it is read; `on_write` sees a new value before it is stored and
    may refuse it by raising SdoAbort.
    """

    def __init__(self, node_id: int, eds_path: Path = EDS_PATH) -> None:
        self._od = canopen.import_od(str(eds_path), node_id)
        self._variables: dict[Key, Any] = {
            (variable.index, variable.subindex): variable for variable in _variables(self._od)
        }
        self._values: dict[Key, Any] = {}
        self.live: dict[Key, Callable[[], int]] = {}
        self.on_write: dict[Key, Callable[[int], object]] = {}
        self.reset()

    def reset(self, *, communication_only: bool = False) -> None:
        """Return all objects, or those below 2000, to the EDS file's defaults."""
        for key, variable in self._variables.items():
            if key[0] <= LAST_COMMUNICATION_INDEX or not communication_only:
                self._values[key] = variable.default

    def get(self, index: int, subindex: int = 0) -> int:
        """Return a numeric object."""
        key = (index, subindex)
        live = self.live.get(key)
        value: int = self._values[key] if live is None else live()
        return value

    def set(self, index: int, subindex: int, value: int) -> None:
        """Store a value from inside the drive, unchecked."""
        self._values[index, subindex] = value

    def read(self, index: int, subindex: int) -> bytes:
        """Return an object's bytes.

        Raises:
            SdoAbort: there is no such object, or it cannot be read.
        """
        variable = self._variable(index, subindex)
        if not variable.readable:
            raise SdoAbort(WRITE_ONLY)
        live = self.live.get((index, subindex))
        value = live() if live is not None else self._values[index, subindex]
        return bytes(variable.encode_raw(value))

    def write(self, index: int, subindex: int, data: bytes) -> None:
        """Check and store an object's bytes.

        Raises:
            SdoAbort: no such object, not writable, wrong length, out of range, or refused.
        """
        variable = self._variable(index, subindex)
        if not variable.writable:
            raise SdoAbort(READ_ONLY)
        if len(data) * 8 != len(variable):
            raise SdoAbort(WRONG_LENGTH)
        value = variable.decode_raw(data)
        if _outside(value, variable.min, variable.max):
            raise SdoAbort(VALUE_RANGE)
        react = self.on_write.get((index, subindex))
        if react is not None:
            react(value)
        self._values[index, subindex] = value

    def _variable(self, index: int, subindex: int) -> Any:
        variable = self._variables.get((index, subindex))
        if variable is not None:
            return variable
        raise SdoAbort(NO_SUBINDEX if index in self._od else NO_OBJECT)


def _variables(od: canopen.ObjectDictionary) -> list[Any]:
    found: list[Any] = []
    for entry in od.values():
        members = (
            [entry] if isinstance(entry, canopen.objectdictionary.ODVariable) else entry.values()
        )
        found.extend(members)
    return found


def _outside(value: int, low: int | None, high: int | None) -> bool:
    return (low is not None and value < low) or (high is not None and value > high)
