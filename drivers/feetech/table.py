"""Hold the control tables of FEETECH servos as data.

Source: FEETECH, "SMS/STS memory table" and "SCS memory table". A register with a `sign_bit` holds
sign and magnitude, not two's complement: the bit says that the rest is negative. STS and SMS send
the low byte first, SCS the high one.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from enum import IntEnum
from math import pi
from types import MappingProxyType
from typing import Final, Literal

from drivers.servo.hardware_error import HardwareError

STEPS_PER_REV: Final = 4096
CENTRE_STEP: Final = 2048
STEP_RAD: Final = 2 * pi / STEPS_PER_REV
LOAD_FULL: Final = 1000
"""present_load and the torque limits count in thousandths of the full PWM duty."""
FEETECH_CURRENT_UNIT_A: Final = 6.5e-3
FEETECH_VOLTAGE_UNIT_V: Final = 0.1
ACCELERATION_UNIT_STEP_S2: Final = 100.0
PROTECTION_TIME_UNIT_S: Final = 0.01
FINE_SPEEDS: Final = 0x04
"""Bit of phase (18): speeds count in steps per second, not in fifties of them."""
MULTI_TURN_FEEDBACK: Final = 0x10
"""Bit of phase (18): positions go on beyond one turn."""

FEETECH_BAUD_RATES: Final[Mapping[int, int]] = MappingProxyType(
    {0: 1_000_000, 1: 500_000, 2: 250_000, 3: 128_000, 4: 115_200}
)
"""Bits per second by the value of baud_rate (6). Of 5 to 7 two tables are about: left out."""


class FeetechMode(IntEnum):
    """Name the values of operating_mode (33)."""

    POSITION = 0
    VELOCITY = 1
    PWM = 2
    STEP = 3


class TorqueSwitch(IntEnum):
    """Name the values of torque_enable (40)."""

    FREE = 0
    ON = 1
    DAMPED = 2
    CENTRE_HERE = 128
    """Make the present position 2048, by the homing offset."""


ERROR_BITS: Final[Mapping[int, HardwareError]] = MappingProxyType(
    {
        0x01: HardwareError.INPUT_VOLTAGE,
        0x02: HardwareError.ENCODER,
        0x04: HardwareError.OVERHEATING,
        0x08: HardwareError.OVERCURRENT,
        0x20: HardwareError.OVERLOAD,
    }
)
"""Bits of a status packet's error byte, and of status (65), in the words of all families."""


@dataclass(frozen=True, slots=True, kw_only=True)
class FeetechRegister:
    """Describe one item of a control table; `initial` is what a new servo holds."""

    name: str
    address: int
    size: int = 1
    access: Literal["r", "rw"] = "rw"
    eeprom: bool = False
    sign_bit: int | None = None
    initial: int = 0
    byte_order: Literal["little", "big"] = "little"

    @property
    def minimum(self) -> int:
        """Return the least value that the register can hold."""
        return 0 if self.sign_bit is None else 1 - (1 << self.sign_bit)

    @property
    def maximum(self) -> int:
        """Return the largest value that the register can hold."""
        return (1 << (8 * self.size if self.sign_bit is None else self.sign_bit)) - 1

    def to_bytes(self, value: int) -> bytes:
        """Encode a value as the servo stores it.

        Raises:
            OverflowError: the value does not fit.
        """
        if not self.minimum <= value <= self.maximum:
            raise OverflowError(f"{self.name}: {self.minimum}..{self.maximum}, got {value}")
        sign = 1 << self.sign_bit if value < 0 and self.sign_bit is not None else 0
        return (abs(value) | sign).to_bytes(self.size, self.byte_order)

    def from_bytes(self, data: bytes) -> int:
        """Decode what the servo stores; minus zero is zero."""
        raw = int.from_bytes(data, self.byte_order)
        if self.sign_bit is None:
            return raw
        magnitude = raw & ((1 << self.sign_bit) - 1)
        return -magnitude if raw >> self.sign_bit & 1 else magnitude


def _eeprom(name: str, address: int, size: int = 1, initial: int = 0) -> FeetechRegister:
    return FeetechRegister(name=name, address=address, size=size, eeprom=True, initial=initial)


def _sensed(name: str, address: int, size: int = 1, sign_bit: int | None = None) -> FeetechRegister:
    return FeetechRegister(name=name, address=address, size=size, access="r", sign_bit=sign_bit)


_COMMON: Final = (
    FeetechRegister(name="firmware_major", address=0, access="r", eeprom=True, initial=3),
    FeetechRegister(name="firmware_minor", address=1, access="r", eeprom=True, initial=10),
    FeetechRegister(name="model_number", address=3, size=2, access="r", eeprom=True),
    _eeprom("id", 5, initial=1),
    _eeprom("baud_rate", 6),
    _eeprom("return_delay_time", 7, initial=250),
    _eeprom("status_return_level", 8, initial=1),
    _eeprom("min_position_limit", 9, 2),
    _eeprom("max_position_limit", 11, 2, 4095),
    _eeprom("temperature_limit", 13, initial=70),
    _eeprom("max_voltage_limit", 14, initial=140),
    _eeprom("min_voltage_limit", 15, initial=40),
    _eeprom("max_torque_limit", 16, 2, 1000),
    _eeprom("phase", 18, initial=12),
    _eeprom("shutdown", 19, initial=44),
    _eeprom("led_alarm", 20, initial=47),
    _eeprom("position_p_gain", 21, initial=32),
    _eeprom("position_d_gain", 22, initial=32),
    _eeprom("position_i_gain", 23),
    _eeprom("minimum_start_force", 24, initial=16),
    _eeprom("cw_dead_zone", 26, initial=1),
    _eeprom("ccw_dead_zone", 27, initial=1),
    FeetechRegister(name="torque_enable", address=40),
    FeetechRegister(name="acceleration", address=41),
    FeetechRegister(name="goal_position", address=42, size=2, sign_bit=15),
    FeetechRegister(name="goal_time", address=44, size=2, sign_bit=10),
    FeetechRegister(name="goal_velocity", address=46, size=2, sign_bit=15),
    _sensed("present_position", 56, 2, 15),
    _sensed("present_velocity", 58, 2, 15),
    _sensed("present_load", 60, 2, 10),
    _sensed("present_voltage", 62),
    _sensed("present_temperature", 63),
    _sensed("registered_instruction", 64),
    _sensed("hardware_error_status", 65),
    _sensed("moving", 66),
    _sensed("moving_threshold", 80),
)
_STS: Final = (
    *_COMMON,
    _eeprom("integral_limit", 25),
    _eeprom("protection_current", 28, 2, 500),
    _eeprom("angular_resolution", 30, initial=1),
    FeetechRegister(name="homing_offset", address=31, size=2, eeprom=True, sign_bit=11),
    _eeprom("operating_mode", 33),
    _eeprom("protective_torque", 34, initial=20),
    _eeprom("protection_time", 35, initial=200),
    _eeprom("overload_torque", 36, initial=80),
    _eeprom("velocity_p_gain", 37, initial=10),
    _eeprom("overcurrent_time", 38, initial=200),
    _eeprom("velocity_i_gain", 39, initial=200),
    FeetechRegister(name="torque_limit", address=48, size=2, initial=1000),
    FeetechRegister(name="lock", address=55, initial=1),
    _sensed("target_position", 67, 2, 15),
    _sensed("present_current", 69, 2),
    FeetechRegister(name="max_velocity_limit", address=84, initial=0),
    FeetechRegister(name="max_acceleration", address=85, initial=0),
)
_SCS: Final = tuple(
    replace(each, byte_order="big")
    for each in (
        *(one for one in _COMMON if one.name not in ("goal_time", "max_position_limit")),
        _eeprom("max_position_limit", 11, 2, 1023),
        FeetechRegister(name="goal_time", address=44, size=2),
        _eeprom("protective_torque", 37, initial=20),
        _eeprom("protection_time", 38, initial=200),
        _eeprom("overload_torque", 39, initial=80),
        FeetechRegister(name="lock", address=48, initial=1),
    )
)


@dataclass(frozen=True, slots=True, kw_only=True)
class FeetechDatasheet:
    """Describe one servo model; torque, current and speed are the datasheet's at `voltage_v`."""

    name: str
    number: int
    stall_torque_nm: float
    stall_current_a: float
    no_load_speed_rad_s: float
    voltage_v: float
    voltage_range_v: tuple[float, float]
    """What the motor stands; beyond it the version of the servo and its supply do not match."""
    gear_ratio: float
    mass_g: float = 55.0
    size_mm: tuple[float, float, float] = (45.2, 24.7, 35.0)
    registers: Mapping[str, FeetechRegister] = field(repr=False)
    steps_per_rev: float = STEPS_PER_REV
    centre_step: int = CENTRE_STEP
    has_sync_read: bool = True
    min_firmware: tuple[int, int] = (3, 10)
    """Before 3.10 sync reads of these models answer damaged."""

    @property
    def byte_order(self) -> Literal["little", "big"]:
        """Return in which order the bytes of a register are sent."""
        return self.registers["goal_position"].byte_order

    @property
    def step_rad(self) -> float:
        """Return the angle of one step."""
        return 2 * pi / self.steps_per_rev


def _by_name(rows: tuple[FeetechRegister, ...]) -> Mapping[str, FeetechRegister]:
    return MappingProxyType({row.name: row for row in sorted(rows, key=lambda row: row.address)})


_STS_REGISTERS: Final = _by_name(_STS)
_STS_REGISTERS_7_V: Final = _by_name(
    tuple(replace(each, initial=80) if each.name == "max_voltage_limit" else each for each in _STS)
)
_RPM: Final = 2 * pi / 60


def _sts3215(
    name: str, *, stall: tuple[float, float], rpm: float, volts: float, gear: float
) -> FeetechDatasheet:
    is_7_v = volts < 9.0
    low, high = (4.0, 8.4) if is_7_v else (4.0, 14.0)
    return FeetechDatasheet(
        name=name,
        number=777,
        stall_torque_nm=stall[0],
        stall_current_a=stall[1],
        no_load_speed_rad_s=rpm * _RPM,
        voltage_v=volts,
        voltage_range_v=(low, high),
        gear_ratio=gear,
        registers=_STS_REGISTERS_7_V if is_7_v else _STS_REGISTERS,
    )


FEETECH_MODELS: Final[Mapping[str, FeetechDatasheet]] = MappingProxyType(
    {
        sheet.name: sheet
        for sheet in (
            _sts3215("STS3215-C001", stall=(1.91, 2.4), rpm=52.0, volts=7.4, gear=345.0),
            _sts3215("STS3215-C018", stall=(2.94, 2.7), rpm=45.0, volts=12.0, gear=345.0),
            _sts3215("STS3215-C044", stall=(2.16, 2.4), rpm=86.0, volts=7.4, gear=191.0),
            _sts3215("STS3215-C046", stall=(1.37, 2.4), rpm=115.0, volts=7.4, gear=147.0),
            FeetechDatasheet(
                name="STS3250",
                number=2825,
                stall_torque_nm=4.9,
                stall_current_a=3.0,
                no_load_speed_rad_s=75.0 * _RPM,
                voltage_v=12.0,
                voltage_range_v=(6.0, 12.6),
                gear_ratio=254.0,
                registers=_STS_REGISTERS,
            ),
            FeetechDatasheet(
                name="SCS0009",
                number=1284,
                stall_torque_nm=0.226,
                stall_current_a=0.8,
                no_load_speed_rad_s=100.0 * _RPM,
                voltage_v=6.0,
                voltage_range_v=(4.8, 7.4),
                gear_ratio=150.0,
                mass_g=13.2,
                size_mm=(23.2, 12.1, 25.3),
                registers=_by_name(_SCS),
                steps_per_rev=1024 * 360 / 300,
                centre_step=511,
                has_sync_read=False,
                min_firmware=(0, 0),
            ),
        )
    }
)
"""Servos by name: one number may stand for several motors and gears, which the file must tell.

Stall current of the 7.4 V versions, gear of the STS3250, and current, gear and weight of the
SCS0009 are in no table that we have: chosen from servos of that size.
"""


def turns_wheels(model: str) -> bool:
    """Return whether a model has a velocity mode."""
    return model in FEETECH_MODELS and "operating_mode" in FEETECH_MODELS[model].registers


def hardware_errors(bits: int) -> int:
    """Return an error byte in the bits of `HardwareError`; reserved bits are left out."""
    found = HardwareError(0)
    for bit, error in ERROR_BITS.items():
        if bits & bit:
            found |= error
    return int(found)


def models_of(data: bytes) -> tuple[list[str], int]:
    """Return the models with a number, and the number, in the byte order that makes sense.

    STS and SMS send the low byte first, SCS the high one: whichever of the two is known is taken.
    """
    little, big = int.from_bytes(data, "little"), int.from_bytes(data, "big")
    for number in (little, big):
        if names := model_names(number):
            return names, number
    return [], little


def model_names(number: int) -> list[str]:
    """Return the models that share a number: several motors and gears may."""
    return [name for name, sheet in FEETECH_MODELS.items() if sheet.number == number]
