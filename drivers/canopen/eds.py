"""Read a drive's EDS file: which objects it has, their types, ranges and what may be mapped."""

import configparser
from functools import lru_cache
from pathlib import Path
from typing import Any, Final

import canopen

from drivers.errors import DeviceMissing, ProtocolError, WrongDevice

_PARSE_ERRORS: Final = (configparser.Error, ValueError, KeyError, AttributeError, TypeError)


class DriveDictionary:
    """Encode, decode and range-check the objects of one drive as its EDS file declares them."""

    def __init__(self, path: Path, node_id: int) -> None:
        """Read the file.

        Raises:
            DeviceMissing: there is no such file.
            WrongDevice: it is not an EDS file.
        """
        self._name = f"EDS file {path} of node {node_id}"
        if not path.is_file():
            raise DeviceMissing(f"{self._name} does not exist; correct `eds` in the robot file")
        try:
            self._od = canopen.import_od(str(path), node_id)
        except _PARSE_ERRORS as error:
            raise WrongDevice(f"{self._name} cannot be read as an EDS file: {error}") from error

    def has(self, index: int, subindex: int = 0) -> bool:
        """Return whether the drive has the object."""
        return self._od.get_variable(index, subindex) is not None

    def default(self, index: int, subindex: int = 0) -> int | None:
        """Return the default of a numeric object, None where the file gives none."""
        variable = self._od.get_variable(index, subindex)
        value = None if variable is None else variable.default
        return value if isinstance(value, int) else None

    def writable(self, index: int, subindex: int = 0) -> bool:
        """Return whether the drive has the object and lets it be written."""
        variable = self._od.get_variable(index, subindex)
        return variable is not None and bool(variable.writable)

    def mappable(self, index: int, bits: int) -> bool:
        """Return whether an object of that length may be mapped into a PDO."""
        variable = self._od.get_variable(index, 0)
        return variable is not None and bool(variable.pdo_mappable) and len(variable) == bits

    def encode(self, index: int, subindex: int, value: int) -> bytes:
        """Return a value's bytes in the object's declared type.

        Raises:
            WrongDevice: the value is outside the object's declared range or type.
        """
        variable = self._variable(index, subindex)
        low, high = variable.min, variable.max
        where = f"{self._name}: 0x{index:04X}:{subindex:X} ({variable.name})"
        if (low is not None and value < low) or (high is not None and value > high):
            raise WrongDevice(
                f"{where} takes {_bound(low)}..{_bound(high)}, not {value}; correct the robot file"
            )
        try:
            return bytes(variable.encode_raw(value))
        except (ValueError, TypeError, canopen.ObjectDictionaryError) as error:
            raise WrongDevice(f"{where} does not take {value}: {error}") from error

    def decode(self, index: int, subindex: int, data: bytes) -> int:
        """Return the number that the object's bytes mean.

        Raises:
            ProtocolError: the length is not that of the declared type, or it is no number.
        """
        variable = self._variable(index, subindex)
        if len(data) * 8 != len(variable) or variable.data_type not in canopen_integers():
            raise ProtocolError(
                f"0x{index:04X}:{subindex:X} has {len(data)} bytes, expected an integer of "
                f"{len(variable) // 8} by {self._name}"
            )
        return int(variable.decode_raw(data))

    def _variable(self, index: int, subindex: int) -> Any:
        variable = self._od.get_variable(index, subindex)
        if variable is None:
            raise WrongDevice(f"{self._name} has no object 0x{index:04X}:{subindex:X}")
        return variable


def canopen_integers() -> frozenset[int]:
    """Return the data types (CiA 301) that are whole numbers or truth values."""
    types = canopen.objectdictionary.datatypes
    return frozenset((types.BOOLEAN, *types.INTEGER_TYPES))


def _bound(value: int | None) -> str:
    return "" if value is None else str(value)


@lru_cache(maxsize=32)
def read_dictionary(path: Path, node_id: int) -> DriveDictionary:
    """Return the dictionary of a file and node; it is parsed once, for that takes many ticks.

    Raises:
        DeviceMissing: there is no such file.
        WrongDevice: it is not an EDS file.
    """
    return DriveDictionary(path, node_id)
