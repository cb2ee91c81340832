"""Describe what a servo model is made of: registers, units, modes and the indirect block.

Source: ROBOTIS e-manual, pages of the X series (control table and specifications).
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import IntEnum
from math import pi
from types import MappingProxyType
from typing import Final, Literal

PULSES_PER_REV: Final = 4096
CENTRE_PULSE: Final = 2048
"""The pulse at which a servo's horn is drawn in the datasheet; a joint's offset counts from it."""
PULSE_RAD: Final = 2 * pi / PULSES_PER_REV
VELOCITY_UNIT_RAD_S: Final = 0.229 * 2 * pi / 60
CURRENT_UNIT_A: Final = 2.69e-3
SUPPLY_CURRENT_UNIT_A: Final = 1e-3
"""Of an X330, which measures at its supply, not in the motor."""
LOAD_UNIT_RATIO: Final = 1e-3
VOLTAGE_UNIT_V: Final = 0.1
PWM_FULL: Final = 885
WATCHDOG_UNIT_S: Final = 0.02
WATCHDOG_MAX: Final = 127
WATCHDOG_TRIPPED: Final = -1


class OperatingMode(IntEnum):
    """Name the values of operating_mode (11)."""

    CURRENT = 0
    VELOCITY = 1
    POSITION = 3
    EXTENDED_POSITION = 4
    CURRENT_BASED_POSITION = 5
    PWM = 16


class StatusReturnLevel(IntEnum):
    """Name the values of status_return_level (68): which instructions get an answer."""

    PING = 0
    READ = 1
    ALL = 2


BAUD_RATES: Final[Mapping[int, int]] = MappingProxyType(
    {
        0: 9_600,
        1: 57_600,
        2: 115_200,
        3: 1_000_000,
        4: 2_000_000,
        5: 3_000_000,
        6: 4_000_000,
        7: 4_500_000,
    }
)
"""Bits per second by the value of baud_rate (8)."""


@dataclass(frozen=True, slots=True)
class Register:
    """Describe one item of the control table; `initial` is None where the table has no constant."""

    name: str
    address: int
    size: int
    access: Literal["r", "rw"]
    eeprom: bool
    signed: bool
    initial: int | None
    minimum: int | None
    maximum: int | None

    @property
    def writable(self) -> bool:
        """Return whether the host may write it."""
        return self.access == "rw"

    def to_bytes(self, value: int) -> bytes:
        """Encode a value as the servo stores it.

        Raises:
            OverflowError: the value does not fit in the register's bytes.
        """
        return value.to_bytes(self.size, "little", signed=self.signed)

    def from_bytes(self, data: bytes) -> int:
        """Decode what the servo stores."""
        return int.from_bytes(data, "little", signed=self.signed)


@dataclass(frozen=True, slots=True)
class IndirectBank:
    """Locate slots: the address written at `addresses + 2 n` appears at `data + n`.

    The map is RAM: a reboot or a power cycle points every slot at itself again, where it reads 0.
    """

    addresses: int
    data: int
    slots: int


@dataclass(frozen=True, slots=True, kw_only=True)
class ServoDatasheet:
    """Describe one servo model; torque, current and speed are the datasheet's at `voltage_v`."""

    name: str
    number: int
    registers: Mapping[str, Register]
    registers_by_address: Mapping[int, Register] = field(repr=False)
    operating_modes: frozenset[OperatingMode]
    stall_torque_nm: float
    stall_current_a: float
    no_load_speed_rad_s: float
    voltage_v: float = 12.0
    velocity_unit_rad_s: float = VELOCITY_UNIT_RAD_S
    current_unit_a: float | None
    """None: address 126 holds present_load, not present_current."""
    pwm_limit: int = PWM_FULL
    min_firmware_fast_sync: int | None = 45
    """None: the model has no fast sync read in any firmware."""
    min_firmware_watchdog: int = 38
    indirect: tuple[tuple[int, tuple[IndirectBank, ...]], ...] = ()
    """Banks by the firmware they came with, the newest first."""

    @property
    def senses_supply_current(self) -> bool:
        """Return whether address 126 tells the supply's current, not the motor's."""
        return self.current_unit_a == SUPPLY_CURRENT_UNIT_A

    @property
    def effort_unit_ratio(self) -> float:
        """Give the worth of one unit at address 126 as a ratio of stall current, or of load."""
        if self.current_unit_a is None:
            return LOAD_UNIT_RATIO
        return self.current_unit_a / self.stall_current_a

    def has_fast_sync(self, firmware: int) -> bool:
        """Return whether a servo with this firmware answers fast sync reads."""
        return self.min_firmware_fast_sync is not None and firmware >= self.min_firmware_fast_sync

    def indirect_banks(self, firmware: int) -> tuple[IndirectBank, ...]:
        """Return where the indirect slots of a servo with this firmware are."""
        return next((banks for least, banks in self.indirect if firmware >= least), ())
