"""Hold the emulated drive's objects, with types, defaults and access rights from the EDS file."""

from collections.abc import Callable
from functools import lru_cache
from pathlib import Path
from typing import Any, Final

import canopen

from drivers.canopen.eds import canopen_integers
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

    From outside only the EDS file's objects can be seen. Inside there are those of the stack's own
    EDS file too, for the firmware works with them whether they are shown or not.

    `values` are those stored; `live` computes an object when it is read; `on_write` sees a new
    value before it is stored and may refuse it by raising SdoAbort; `after_write` sees it stored.
    """

    def __init__(self, node_id: int, eds_path: Path = EDS_PATH) -> None:
        self._eds_path = eds_path
        self.readdress(node_id)
        self.values: dict[Key, Any] = {}
        self.live: dict[Key, Callable[[], int]] = {}
        self.on_write: dict[Key, Callable[[int], object]] = {}
        self.after_write: dict[Key, Callable[[], None]] = {}
        self.reset()

    def reset(self, *, communication_only: bool = False) -> None:
        """Return all objects, or those below 2000, to the EDS file's defaults."""
        for key, default in self._defaults.items():
            if key[0] <= LAST_COMMUNICATION_INDEX or not communication_only:
                self.values[key] = default
        for follow in dict.fromkeys(self.after_write.values()):
            follow()

    def get(self, index: int, subindex: int = 0) -> int:
        """Return a numeric object."""
        key = (index, subindex)
        live = self.live.get(key)
        value: int = self.values[key] if live is None else live()
        return value

    def set(self, index: int, subindex: int, value: int) -> None:
        """Store a value from inside the drive, unchecked."""
        self.values[index, subindex] = value

    def read(self, index: int, subindex: int) -> bytes:
        """Return an object's bytes.

        Raises:
            SdoAbort: there is no such object, or it cannot be read.
        """
        variable = self._variable(index, subindex)
        if not variable.readable:
            raise SdoAbort(WRITE_ONLY)
        live = self.live.get((index, subindex))
        value = live() if live is not None else self.values[index, subindex]
        return bytes(variable.encode_raw(value))

    def write(self, index: int, subindex: int, data: bytes) -> None:
        """Check and store an object's bytes.

        Raises:
            SdoAbort: no such object, not writable, wrong length, out of range, or refused.
        """
        variable = self.check_writable(index, subindex)
        if _has_fixed_length(variable) and len(data) * 8 != len(variable):
            raise SdoAbort(WRONG_LENGTH)
        value = variable.decode_raw(data)
        if _outside(value, variable.min, variable.max):
            raise SdoAbort(VALUE_RANGE)
        react = self.on_write.get((index, subindex))
        if react is not None:
            react(value)
        self.values[index, subindex] = value
        follow = self.after_write.get((index, subindex))
        if follow is not None:
            follow()

    def check_writable(self, index: int, subindex: int) -> Any:
        """Return the description of an object that may be written.

        Raises:
            SdoAbort: no such object, or not writable.
        """
        variable = self._variable(index, subindex)
        if not variable.writable:
            raise SdoAbort(READ_ONLY)
        return variable

    def store_if_valid(self, key: Key, value: int) -> None:
        """Store a number that came by PDO, unless it is out of range: nobody can be told."""
        variable = self._variables[key]
        if not _outside(value, variable.min, variable.max):
            self.values[key] = value

    def readdress(self, node_id: int) -> None:
        """Take the defaults of another node id, with the next reset."""
        self._variables = dict(_by_key(str(self._eds_path), node_id))
        own = _by_key(str(EDS_PATH), node_id)
        self._defaults: dict[Key, Any] = {
            key: _default(self._variables.get(key), own.get(key))
            for key in dict.fromkeys((*own, *self._variables))
        }

    def reader(self, key: Key) -> Callable[[], int]:
        """Return what reads a numeric object again and again."""
        return self.live.get(key) or (lambda: self.get(*key))

    def has(self, key: Key) -> bool:
        """Return whether there is such an object."""
        return key in self._variables

    def highest_subindex(self, index: int) -> int:
        """Return the highest sub-index of a record."""
        return max(subindex for known, subindex in self._defaults if known == index)

    def mappable(self, key: Key, bits: int, *, transmits: bool) -> bool:
        """Return whether an object of that length may be part of a PDO."""
        variable = self._variable(*key)
        allowed = variable.readable if transmits else variable.writable
        return bool(variable.pdo_mappable and allowed and len(variable) == bits)

    def wire_format(self, key: Key) -> str:
        """Return the struct format of a numeric object."""
        layout: str = self._variable(*key).STRUCT_TYPES[self._variable(*key).data_type].format
        return layout.lstrip("<")

    def _variable(self, index: int, subindex: int) -> Any:
        variable = self._variables.get((index, subindex))
        if variable is not None:
            return variable
        known = any(index == each for each, _ in self._variables)
        raise SdoAbort(NO_SUBINDEX if known else NO_OBJECT)


@lru_cache(maxsize=32)
def _by_key(eds_path: str, node_id: int) -> dict[Key, Any]:
    od = canopen.import_od(eds_path, node_id)
    return {(variable.index, variable.subindex): variable for variable in _variables(od)}


def _default(shown: Any, own: Any) -> Any:
    """Return the file's default; where it gives none, that of our own file, else nothing."""
    known = [variable for variable in (shown, own) if variable is not None]
    for variable in known:
        if variable.default is not None:
            return variable.default
    return 0 if known[0].data_type in canopen_integers() else b""


def _variables(od: canopen.ObjectDictionary) -> list[Any]:
    found: list[Any] = []
    for entry in od.values():
        members = (
            [entry] if isinstance(entry, canopen.objectdictionary.ODVariable) else entry.values()
        )
        found.extend(members)
    return found


def _has_fixed_length(variable: Any) -> bool:
    return variable.data_type not in canopen.objectdictionary.DATA_TYPES


def _outside(value: int, low: int | None, high: int | None) -> bool:
    return (low is not None and value < low) or (high is not None and value > high)
