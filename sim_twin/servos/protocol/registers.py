"""Hold a servo's control table and check every access as the firmware does.

Source: ROBOTIS e-manual, "DYNAMIXEL Protocol 2.0" (status packet, error) and "XM430-W350". A read
of addresses that hold no register gives zeros, as long as it ends within the table. A write is
refused as a whole when any part of it is; through indirect data it is judged as if it went straight
to the registers behind it, so a part of a register is too short there too.
"""

import struct
from collections.abc import Callable, Iterator
from functools import partial
from typing import Any, Final

from drivers.dynamixel.tables.control_table import MODELS, OperatingMode, Register, ServoDatasheet
from drivers.dynamixel.wire.codec import StatusError
from sim_twin.servos.protocol.indirect import ADDRESS_PREFIX, indirect_registers
from sim_twin.servos.spec import EmulatedServoSpec

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

SENSED: Final = range(120, 147)
"""Addresses of what a servo senses, realtime tick to temperature."""

_BACKED_UP_RAM: Final = (
    "velocity_i_gain",
    "velocity_p_gain",
    "position_d_gain",
    "position_i_gain",
    "position_p_gain",
    "feedforward_2nd_gain",
    "feedforward_1st_gain",
    "profile_acceleration",
    "profile_velocity",
)
"""RAM that a control table backup holds, beside the EEPROM and the indirect addresses."""

_RESTORE_AT_START: Final = 0x02

_FORMATS: Final = {
    (size, signed): struct.Struct("<" + (code if signed else code.upper()))
    for size, code in ((1, "b"), (2, "h"), (4, "i"))
    for signed in (False, True)
}
"""How a register is laid out, by its bytes and by whether it has a sign."""

_KEPT_BY_RESET: Final = {0xFF: (), 0x01: ("id",), 0x02: ("id", "baud_rate")}
"""What each factory reset option keeps."""


class AccessRefused(Exception):
    """Carry the status error number of an access that the firmware refuses."""

    def __init__(self, number: StatusError) -> None:
        super().__init__(number.name)
        self.number = number


class ControlTable:
    """Be the memory of one servo; `on_remap` is called when its indirect addresses change."""

    def __init__(
        self, spec: EmulatedServoSpec, memory: memoryview, on_remap: Callable[[], None]
    ) -> None:
        self.model: ServoDatasheet = MODELS[spec.model_name]
        self._spec = spec
        self._memory = memory
        self._on_remap = on_remap
        self._banks = self.model.indirect_banks(spec.firmware_version)
        self._registers = dict(self.model.registers) | {
            register.name: register for register in indirect_registers(self._banks)
        }
        too_new = _too_new(self.model, spec.firmware_version)
        self._by_address = {
            each.address: each for each in self._registers.values() if each.name not in too_new
        }
        self._backup: dict[str, int] = {}
        self._targets: dict[tuple[int, int], tuple[int, ...]] = {}
        self.end = max(r.address + r.size for r in self._registers.values())
        self._unpackers = {
            register.name: _unpacker(register, memory) for register in self._registers.values()
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
        register = self._registers[name]
        end = register.address + register.size
        self._memory[register.address : end] = register.to_bytes(value)
        if name.startswith(ADDRESS_PREFIX):
            self._targets.clear()
            self._on_remap()

    def sensed(self) -> bytes:
        """Return what is at the addresses `SENSED`."""
        return bytes(self._memory[SENSED.start : SENSED.stop])

    def targets(self, address: int, length: int) -> tuple[int, ...]:
        """Return where the bytes of a range are, each on its own; () for a range without slots."""
        end = address + length
        if not any(bank.data < end and address < bank.data + bank.slots for bank in self._banks):
            return ()
        if (address, length) not in self._targets:
            targets = tuple(self._target(each) for each in range(address, end))
            self._targets[address, length] = targets
        return self._targets[address, length]

    def read(self, address: int, length: int, sensed: bytes | None = None) -> bytes:
        """Return `length` bytes as the host asks for them; `sensed` replaces what is sensed now.

        Raises:
            Refused: the range is empty or ends beyond the table.
        """
        if length == 0:
            raise AccessRefused(StatusError.DATA_LENGTH)
        if address + length > self.end:
            raise AccessRefused(StatusError.ACCESS)
        memory: memoryview | bytearray = self._memory
        if sensed is not None:
            memory = bytearray(memory)
            memory[SENSED.start : SENSED.stop] = sensed
        targets = self.targets(address, length)
        if targets:
            return bytes(memory[target] for target in targets)
        return bytes(memory[address : address + length])

    def check_write(self, address: int, data: bytes) -> list[tuple[Register, int]]:
        """Return the registers that a host's write would set, and their values.

        Raises:
            Refused: the firmware answers the write with an error.
        """
        if not data:
            raise AccessRefused(StatusError.DATA_LENGTH)
        writes: list[tuple[Register, int]] = []
        for start, run in self._runs(address, data):
            writes += self._check_run(start, run)
        return writes

    def power_on(self) -> None:
        """Give the RAM its defaults, or its backup where the startup configuration asks for it."""
        self._load_defaults(eeprom=False)
        if not self._backup:
            return
        self.put("backup_ready", 1)
        if self.get("startup_configuration") & _RESTORE_AT_START:
            self._restore(eeprom=False)

    def back_up(self) -> None:
        """Keep the EEPROM, gains, profile and indirect addresses."""
        self._backup = {
            name: self.get(name)
            for name, register in self._registers.items()
            if (register.eeprom and register.writable)
            or name in _BACKED_UP_RAM
            or name.startswith(ADDRESS_PREFIX)
        }
        self.put("backup_ready", 1)

    def restore(self) -> None:
        """Give the EEPROM the values of the backup.

        Raises:
            Refused: there is no backup.
        """
        if not self._backup:
            raise AccessRefused(StatusError.RESULT_FAIL)
        self._restore(eeprom=True)

    def _restore(self, *, eeprom: bool) -> None:
        for name, value in self._backup.items():
            if self._registers[name].eeprom == eeprom:
                self.put(name, value)

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
            raise AccessRefused(StatusError.DATA_RANGE)
        kept = {name: self.get(name) for name in _KEPT_BY_RESET[option]}
        self._load_defaults(eeprom=True)
        self.put("firmware_version", self._spec.firmware_version)
        for name, value in kept.items():
            self.put(name, value)

    def _load_defaults(self, *, eeprom: bool) -> None:
        for register in self._registers.values():
            if register.eeprom == eeprom:
                self.put(register.name, register.initial or 0)

    def _target(self, address: int) -> int:
        for bank in self._banks:
            slot = address - bank.data
            if 0 <= slot < bank.slots:
                return self.get(self._by_address[bank.addresses + 2 * slot].name)
        return address

    def _runs(self, address: int, data: bytes) -> Iterator[tuple[int, bytes]]:
        """Cut a write where the addresses behind it do not go on one by one."""
        targets = self.targets(address, len(data))
        if not targets:
            yield address, data
            return
        start = 0
        for count in range(1, len(data) + 1):
            if count == len(data) or targets[count] != targets[count - 1] + 1:
                yield targets[start], data[start:count]
                start = count

    def _check_run(self, address: int, data: bytes) -> Iterator[tuple[Register, int]]:
        while data:
            register = self._writable_register(address, len(data))
            value = register.from_bytes(data[: register.size])
            self._check_value(register, value)
            yield register, value
            address, data = address + register.size, data[register.size :]

    def _writable_register(self, address: int, available: int) -> Register:
        register = self._by_address.get(address)
        if register is None or not register.writable:
            raise AccessRefused(StatusError.ACCESS)
        if available < register.size:
            raise AccessRefused(StatusError.DATA_LENGTH)
        if register.eeprom and self.get("torque_enable"):
            raise AccessRefused(StatusError.ACCESS)
        return register

    def _check_value(self, register: Register, value: int) -> None:
        name = register.name
        if register.minimum is not None and value < register.minimum:
            raise AccessRefused(StatusError.DATA_RANGE)
        if register.maximum is not None and value > register.maximum:
            raise AccessRefused(StatusError.DATA_RANGE)
        if name == "operating_mode" and value not in self.model.operating_modes:
            raise AccessRefused(StatusError.DATA_RANGE)
        if self.get("bus_watchdog") < 0 and (name in GOALS or (name == "bus_watchdog" and value)):
            raise AccessRefused(StatusError.DATA_RANGE)
        if name in _LIMITS and abs(value) > self.get(_LIMITS[name]):
            raise AccessRefused(StatusError.DATA_LIMIT)
        if name == "goal_position" and not self._within_position_limits(value):
            raise AccessRefused(StatusError.DATA_LIMIT)

    def _within_position_limits(self, value: int) -> bool:
        if self.get("operating_mode") != OperatingMode.POSITION:
            return True
        return self.get("min_position_limit") <= value <= self.get("max_position_limit")


def _too_new(model: ServoDatasheet, firmware: int) -> frozenset[str]:
    """Return the registers that came with a later firmware, and cannot be written in this one."""
    late = (
        frozenset({"startup_configuration"}) if not model.has_fast_sync(firmware) else frozenset()
    )
    return late | ({"bus_watchdog"} if firmware < model.min_firmware_watchdog else set())


def _unpacker(register: Register, memory: memoryview) -> Callable[[], tuple[Any, ...]]:
    form = _FORMATS[register.size, register.signed]
    return partial(form.unpack_from, memory, register.address)
