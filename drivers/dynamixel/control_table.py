"""Declare the control tables of the Dynamixel X series as data.

Source: ROBOTIS e-manual, pages XM430-W350, XM540-W270, XL430-W250 and XC430-W150 (control table and
specifications). Registers are common to the series; a model lists only where it differs.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from enum import IntEnum, IntFlag
from math import pi
from types import MappingProxyType
from typing import Final, Literal

PULSES_PER_REV: Final = 4096
CENTRE_PULSE: Final = 2048
"""The pulse at which a servo's horn is drawn in the datasheet; a joint's offset counts from it."""
PULSE_RAD: Final = 2 * pi / PULSES_PER_REV
VELOCITY_UNIT_RAD_S: Final = 0.229 * 2 * pi / 60
CURRENT_UNIT_A: Final = 2.69e-3
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


class HardwareError(IntFlag):
    """Name the bits of hardware_error_status (70) and of shutdown (63)."""

    INPUT_VOLTAGE = 1 << 0
    OVERHEATING = 1 << 2
    ENCODER = 1 << 3
    ELECTRICAL_SHOCK = 1 << 4
    OVERLOAD = 1 << 5


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
        """Tell whether the host may write it."""
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


@dataclass(frozen=True, slots=True, kw_only=True)
class Model:
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
    min_firmware_fast_sync: int = 45
    min_firmware_watchdog: int = 38

    @property
    def effort_unit_ratio(self) -> float:
        """Give the worth of one unit at address 126 as a ratio of stall current, or of load."""
        if self.current_unit_a is None:
            return LOAD_UNIT_RATIO
        return self.current_unit_a / self.stall_current_a


# fmt: off
#     name, address, size, access, eeprom, signed, initial, minimum, maximum
_COMMON: Final = (
    Register("model_number", 0, 2, "r", True, False, None, None, None),
    Register("model_information", 2, 4, "r", True, False, 0, None, None),
    Register("firmware_version", 6, 1, "r", True, False, None, None, None),
    Register("id", 7, 1, "rw", True, False, 1, 0, 252),
    Register("baud_rate", 8, 1, "rw", True, False, 1, 0, 7),
    Register("return_delay_time", 9, 1, "rw", True, False, 250, 0, 254),
    Register("drive_mode", 10, 1, "rw", True, False, 0, 0, 13),
    Register("operating_mode", 11, 1, "rw", True, False, 3, 0, 16),
    Register("secondary_id", 12, 1, "rw", True, False, 255, 0, 255),
    Register("protocol_type", 13, 1, "rw", True, False, 2, 1, 2),
    Register("homing_offset", 20, 4, "rw", True, True, 0, -1_044_479, 1_044_479),
    Register("moving_threshold", 24, 4, "rw", True, False, 10, 0, 1023),
    Register("temperature_limit", 31, 1, "rw", True, False, 80, 0, 100),
    Register("max_voltage_limit", 32, 2, "rw", True, False, 160, 95, 160),
    Register("min_voltage_limit", 34, 2, "rw", True, False, 95, 95, 160),
    Register("pwm_limit", 36, 2, "rw", True, False, PWM_FULL, 0, PWM_FULL),
    Register("velocity_limit", 44, 4, "rw", True, False, 200, 0, 1023),
    Register("max_position_limit", 48, 4, "rw", True, False, 4095, 0, 4095),
    Register("min_position_limit", 52, 4, "rw", True, False, 0, 0, 4095),
    Register("startup_configuration", 60, 1, "rw", True, False, 0, 0, 3),
    Register("shutdown", 63, 1, "rw", True, False, 52, 0, 61),
    Register("torque_enable", 64, 1, "rw", False, False, 0, 0, 1),
    Register("led", 65, 1, "rw", False, False, 0, 0, 1),
    Register("status_return_level", 68, 1, "rw", False, False, 2, 0, 2),
    Register("registered_instruction", 69, 1, "r", False, False, 0, None, None),
    Register("hardware_error_status", 70, 1, "r", False, False, 0, None, None),
    Register("velocity_i_gain", 76, 2, "rw", False, False, 1920, 0, 16_383),
    Register("velocity_p_gain", 78, 2, "rw", False, False, 100, 0, 16_383),
    Register("position_d_gain", 80, 2, "rw", False, False, 0, 0, 16_383),
    Register("position_i_gain", 82, 2, "rw", False, False, 0, 0, 16_383),
    Register("position_p_gain", 84, 2, "rw", False, False, 800, 0, 16_383),
    Register("feedforward_2nd_gain", 88, 2, "rw", False, False, 0, 0, 16_383),
    Register("feedforward_1st_gain", 90, 2, "rw", False, False, 0, 0, 16_383),
    Register("bus_watchdog", 98, 1, "rw", False, True, 0, 0, WATCHDOG_MAX),
    Register("goal_pwm", 100, 2, "rw", False, True, PWM_FULL, -PWM_FULL, PWM_FULL),
    Register("goal_velocity", 104, 4, "rw", False, True, 0, -1023, 1023),
    Register("profile_acceleration", 108, 4, "rw", False, False, 0, 0, 32_767),
    Register("profile_velocity", 112, 4, "rw", False, False, 0, 0, 32_767),
    Register("goal_position", 116, 4, "rw", False, True, None, -1_048_575, 1_048_575),
    Register("realtime_tick", 120, 2, "r", False, False, 0, None, None),
    Register("moving", 122, 1, "r", False, False, 0, None, None),
    Register("moving_status", 123, 1, "r", False, False, 0, None, None),
    Register("present_pwm", 124, 2, "r", False, True, 0, None, None),
    Register("present_velocity", 128, 4, "r", False, True, 0, None, None),
    Register("present_position", 132, 4, "r", False, True, None, None, None),
    Register("velocity_trajectory", 136, 4, "r", False, True, 0, None, None),
    Register("position_trajectory", 140, 4, "r", False, True, None, None, None),
    Register("present_input_voltage", 144, 2, "r", False, False, 120, None, None),
    Register("present_temperature", 146, 1, "r", False, False, 25, None, None),
    Register("backup_ready", 147, 1, "r", False, False, 0, None, None),
)
_LOAD_SENSING: Final = (
    Register("present_load", 126, 2, "r", False, True, 0, -1000, 1000),
)
_CURRENT_SENSING: Final = (
    Register("current_limit", 38, 2, "rw", True, False, 1193, 0, 1193),
    Register("goal_current", 102, 2, "rw", False, True, 1193, -1193, 1193),
    Register("present_current", 126, 2, "r", False, True, 0, None, None),
)
# fmt: on

_VOLTAGE_MODES: Final = frozenset(
    {
        OperatingMode.VELOCITY,
        OperatingMode.POSITION,
        OperatingMode.EXTENDED_POSITION,
        OperatingMode.PWM,
    }
)


_Changes = Mapping[str, tuple[int | None, int | None, int | None]]
"""(initial, minimum, maximum) of the registers in which a model differs."""


def _registers(
    extra: tuple[Register, ...], changes: _Changes
) -> tuple[Mapping[str, Register], Mapping[int, Register]]:
    rows = []
    for row in _COMMON + extra:
        initial, minimum, maximum = changes.get(row.name, (row.initial, row.minimum, row.maximum))
        rows.append(replace(row, initial=initial, minimum=minimum, maximum=maximum))
    rows.sort(key=lambda row: row.address)
    return (
        MappingProxyType({row.name: row for row in rows}),
        MappingProxyType({row.address: row for row in rows}),
    )


def _model(
    name: str,
    number: int,
    *,
    stall_torque_nm: float,
    stall_current_a: float,
    no_load_rev_min: float,
    has_current: bool,
    changes: _Changes,
) -> Model:
    extra = _CURRENT_SENSING if has_current else _LOAD_SENSING
    changes = {"model_number": (number, None, None), **changes}
    by_name, by_address = _registers(extra, changes)
    return Model(
        name=name,
        number=number,
        registers=by_name,
        registers_by_address=by_address,
        operating_modes=frozenset(OperatingMode) if has_current else _VOLTAGE_MODES,
        stall_torque_nm=stall_torque_nm,
        stall_current_a=stall_current_a,
        no_load_speed_rad_s=no_load_rev_min * 2 * pi / 60,
        current_unit_a=CURRENT_UNIT_A if has_current else None,
    )


_ALL: Final = (
    _model(
        "XM430-W350",
        1020,
        stall_torque_nm=4.1,
        stall_current_a=2.3,
        no_load_rev_min=46,
        has_current=True,
        changes={},
    ),
    _model(
        "XM540-W270",
        1120,
        stall_torque_nm=10.6,
        stall_current_a=4.4,
        no_load_rev_min=30,
        has_current=True,
        changes={
            "velocity_limit": (128, 0, 1023),
            "current_limit": (2047, 0, 2047),
            "goal_current": (2047, -2047, 2047),
        },
    ),
    _model(
        "XL430-W250",
        1060,
        stall_torque_nm=1.5,
        stall_current_a=1.4,
        no_load_rev_min=61,
        has_current=False,
        changes={
            "temperature_limit": (72, 0, 100),
            "max_voltage_limit": (140, 60, 140),
            "min_voltage_limit": (60, 60, 140),
            "velocity_limit": (265, 0, 1023),
            "velocity_i_gain": (1000, 0, 16_383),
            "position_d_gain": (4000, 0, 16_383),
            "position_p_gain": (640, 0, 16_383),
        },
    ),
    _model(
        "XC430-W150",
        1070,
        stall_torque_nm=1.6,
        stall_current_a=1.4,
        no_load_rev_min=106,
        has_current=False,
        changes={
            "moving_threshold": (20, 0, 1023),
            "max_voltage_limit": (160, 60, 160),
            "min_voltage_limit": (60, 60, 160),
            "velocity_limit": (460, 0, 1023),
            "position_p_gain": (460, 0, 16_383),
        },
    ),
)

MODELS: Final[Mapping[str, Model]] = MappingProxyType({model.name: model for model in _ALL})
MODELS_BY_NUMBER: Final[Mapping[int, Model]] = MappingProxyType(
    {model.number: model for model in _ALL}
)
