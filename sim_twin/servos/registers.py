"""Hold the control tables of the servos on one bus and check every access as the firmware does.

All tables live in one block of bytes: the wire sees a servo's row, the control loop sees a register
of all servos as one numpy column. Both are views of the same memory, so nothing is ever copied
between them.

Source: ROBOTIS e-manual, "DYNAMIXEL Protocol 2.0" (status packet, error) and "XM430-W350". A read
of addresses that hold no register gives zeros, as long as it ends within the table. A write is
refused as a whole when any part of it is. Indirect addresses are not in the table.
"""

import struct
from collections.abc import Callable, Sequence
from functools import partial
from typing import Any, Final

import numpy as np
from numpy.typing import DTypeLike, NDArray

from drivers.dynamixel.codec import StatusError
from drivers.dynamixel.control_table import MODELS, Model, OperatingMode, Register
from sim_twin.servos.spec import EmulatedServoSpec

TABLE_BYTES: Final = 704
GAINS_AND_GOALS: Final = (
    "velocity_i_gain",
    "velocity_p_gain",
    "position_d_gain",
    "position_i_gain",
    "position_p_gain",
    "feedforward_2nd_gain",
    "feedforward_1st_gain",
    "goal_pwm",
    "goal_current",
    "goal_velocity",
    "profile_acceleration",
    "profile_velocity",
)
"""Registers that a change of the operating mode resets."""

GOALS: Final = frozenset({"goal_pwm", "goal_current", "goal_velocity", "goal_position"})
"""Registers that a tripped bus watchdog locks."""

_LIMITS: Final = {
    "goal_pwm": "pwm_limit",
    "goal_current": "current_limit",
    "goal_velocity": "velocity_limit",
}
"""The register that bounds each goal's magnitude."""

_FORMATS: Final = {1: "b", 2: "h", 4: "i"}
"""The struct code of a signed register by its bytes; an unsigned one has the capital."""

_KEPT_BY_RESET: Final = {0xFF: (), 0x01: ("id",), 0x02: ("id", "baud_rate")}
"""What each factory reset option keeps."""


class Refused(Exception):
    """Carry the status error number of an access that the firmware refuses."""

    def __init__(self, number: StatusError) -> None:
        super().__init__(number.name)
        self.number = number


class ControlTable:
    """Be the memory of one servo."""

    def __init__(self, spec: EmulatedServoSpec, memory: memoryview) -> None:
        self.model: Model = MODELS[spec.model_name]
        self._spec = spec
        self._memory = memory
        self.end = max(r.address + r.size for r in self.model.registers.values())
        self._unpackers = {
            register.name: _unpacker(register, memory) for register in self.model.registers.values()
        }
        self._load_defaults(eeprom=True)
        self._load_defaults(eeprom=False)
        self.put("firmware_version", spec.firmware_version)
        self.put("id", spec.id)
        for name, value in spec.eeprom.items():
            self.put(name, value)

    def get(self, name: str) -> int:
        """Return a register's value as the firmware sees it."""
        value: int = self._unpackers[name]()[0]
        return value

    def put(self, name: str, value: int) -> None:
        """Set a register from inside the firmware, unchecked."""
        register = self.model.registers[name]
        end = register.address + register.size
        self._memory[register.address : end] = register.to_bytes(value)

    def read(self, address: int, length: int) -> bytes:
        """Return `length` bytes as the host asks for them.

        Raises:
            Refused: the range is empty or ends beyond the table.
        """
        if length == 0:
            raise Refused(StatusError.DATA_LENGTH)
        if address + length > self.end:
            raise Refused(StatusError.ACCESS)
        return bytes(self._memory[address : address + length])

    def check_write(self, address: int, data: bytes) -> list[tuple[Register, int]]:
        """Return the registers that a host's write would set, and their values.

        Raises:
            Refused: the firmware answers the write with an error.
        """
        if not data:
            raise Refused(StatusError.DATA_LENGTH)
        writes = []
        while data:
            register = self._writable_register(address, len(data))
            value = register.from_bytes(data[: register.size])
            self._check_value(register, value)
            writes.append((register, value))
            address, data = address + register.size, data[register.size :]
        return writes

    def power_on(self) -> None:
        """Give the RAM its defaults, as after power-on or reboot."""
        self._load_defaults(eeprom=False)

    def reset_motion_settings(self) -> None:
        """Reset what a new operating mode resets."""
        for name in GAINS_AND_GOALS:
            register = self.model.registers.get(name)
            if register is not None:
                self.put(name, register.initial or 0)

    def factory_reset(self, option: int) -> None:
        """Give the EEPROM its factory values but for what `option` keeps.

        Raises:
            Refused: the option is none of 0xFF, 1 and 2.
        """
        if option not in _KEPT_BY_RESET:
            raise Refused(StatusError.DATA_RANGE)
        kept = {name: self.get(name) for name in _KEPT_BY_RESET[option]}
        self._load_defaults(eeprom=True)
        self.put("firmware_version", self._spec.firmware_version)
        for name, value in kept.items():
            self.put(name, value)

    def _load_defaults(self, *, eeprom: bool) -> None:
        for register in self.model.registers.values():
            if register.eeprom == eeprom:
                self.put(register.name, register.initial or 0)

    def _writable_register(self, address: int, available: int) -> Register:
        register = self.model.registers_by_address.get(address)
        if register is None or not register.writable:
            raise Refused(StatusError.ACCESS)
        if available < register.size:
            raise Refused(StatusError.DATA_LENGTH)
        if register.eeprom and self.get("torque_enable"):
            raise Refused(StatusError.ACCESS)
        return register

    def _check_value(self, register: Register, value: int) -> None:
        name = register.name
        if register.minimum is not None and value < register.minimum:
            raise Refused(StatusError.DATA_RANGE)
        if register.maximum is not None and value > register.maximum:
            raise Refused(StatusError.DATA_RANGE)
        if name == "operating_mode" and value not in self.model.operating_modes:
            raise Refused(StatusError.DATA_RANGE)
        if self.get("bus_watchdog") < 0 and (name in GOALS or (name == "bus_watchdog" and value)):
            raise Refused(StatusError.DATA_RANGE)
        if name in _LIMITS and abs(value) > self.get(_LIMITS[name]):
            raise Refused(StatusError.DATA_LIMIT)
        if name == "goal_position" and not self._within_position_limits(value):
            raise Refused(StatusError.DATA_LIMIT)

    def _within_position_limits(self, value: int) -> bool:
        if self.get("operating_mode") != OperatingMode.POSITION:
            return True
        return self.get("min_position_limit") <= value <= self.get("max_position_limit")


def _unpacker(register: Register, memory: memoryview) -> Callable[[], tuple[Any, ...]]:
    code = _FORMATS[register.size]
    form = struct.Struct("<" + (code if register.signed else code.upper()))
    return partial(form.unpack_from, memory, register.address)


class RegisterFile:
    """Hold the tables of all servos on a bus in one block of memory."""

    def __init__(self, specs: Sequence[EmulatedServoSpec]) -> None:
        self._bytes = bytearray(len(specs) * TABLE_BYTES)
        view = memoryview(self._bytes)
        self._grid = np.frombuffer(self._bytes, np.uint8).reshape(len(specs), TABLE_BYTES)
        self.tables = tuple(
            ControlTable(spec, view[row * TABLE_BYTES : (row + 1) * TABLE_BYTES])
            for row, spec in enumerate(specs)
        )
        self._shortest = min(table.end for table in self.tables)

    def __len__(self) -> int:
        return len(self.tables)

    def spans(self, rows: Sequence[int], address: int, length: int) -> list[bytes]:
        """Return the same bytes of several tables; none where one of them would refuse the read."""
        if length == 0 or address + length > self._shortest:
            return []
        block = self._grid[rows, address : address + length].tobytes()
        return [block[start : start + length] for start in range(0, len(block), length)]

    def column(self, address: int, dtype: DTypeLike) -> NDArray[np.int32]:
        """Return the register at `address` of all servos as one writable array."""
        size = np.dtype(dtype).itemsize
        return self._grid[:, address : address + size].view(dtype)[:, 0]
