"""Register the servo models as data: what the datasheet says, and where a table differs.

Source: ROBOTIS e-manual, the pages of these models (control table and specifications). XH430-W210
is of an older page without the startup configuration. The smallest firmware of the Bus Watchdog is
documented for X430 and X540; for X330, 2XL and 2XC no limit is, so none is asked for.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from math import pi
from types import MappingProxyType
from typing import Final

from drivers.dynamixel.tables.model import (
    CURRENT_UNIT_A,
    SUPPLY_CURRENT_UNIT_A,
    IndirectBank,
    OperatingMode,
    Register,
    ServoDatasheet,
)
from drivers.dynamixel.tables.table_rows import (
    COMMON,
    CURRENT_SENSING,
    EXTERNAL_PORTS,
    LARGE_INDIRECT,
    LOAD_SENSING,
    PWM_SLOPE,
    SMALL_INDIRECT,
)

Limits = tuple[int | None, int | None, int | None]
"""Initial value, minimum, maximum."""

_VOLTAGE_MODES: Final = frozenset(
    {
        OperatingMode.VELOCITY,
        OperatingMode.POSITION,
        OperatingMode.EXTENDED_POSITION,
        OperatingMode.PWM,
    }
)
_LATE_REGISTERS: Final = frozenset({"startup_configuration", "backup_ready"})


@dataclass(frozen=True, slots=True, kw_only=True)
class _Family:
    """Hold what models of one build have in common."""

    current_unit_a: float | None = None
    extra: tuple[Register, ...] = LOAD_SENSING
    lacks: frozenset[str] = frozenset()
    changes: Mapping[str, Limits] = field(default_factory=dict)
    indirect: tuple[tuple[int, tuple[IndirectBank, ...]], ...] = LARGE_INDIRECT
    fast_sync: int | None = 45
    watchdog: int = 38


_X430: Final = _Family(current_unit_a=CURRENT_UNIT_A, extra=CURRENT_SENSING)
_X540: Final = replace(_X430, extra=CURRENT_SENSING + EXTERNAL_PORTS)
_XL430: Final = _Family()
_2X430: Final = _Family(
    lacks=_LATE_REGISTERS, changes={"drive_mode": (0, 0, 1)}, fast_sync=None, watchdog=1
)
_X330: Final = _Family(
    current_unit_a=SUPPLY_CURRENT_UNIT_A,
    extra=CURRENT_SENSING + PWM_SLOPE,
    changes={
        "baud_rate": (1, 0, 6),
        "protocol_type": (2, 2, 22),
        "temperature_limit": (70, 0, 100),
        "goal_velocity": (0, -2047, 2047),
    },
    indirect=SMALL_INDIRECT,
    fast_sync=46,
    watchdog=1,
)


def _gain(value: int) -> Limits:
    return (value, 0, 16_383)


def _current(limit: int) -> dict[str, Limits]:
    return {"current_limit": (limit, 0, limit), "goal_current": (limit, -limit, limit)}


def _gains(velocity_i: int, velocity_p: int, position_d: int, position_p: int) -> dict[str, Limits]:
    return {
        "velocity_i_gain": _gain(velocity_i),
        "velocity_p_gain": _gain(velocity_p),
        "position_d_gain": _gain(position_d),
        "position_p_gain": _gain(position_p),
    }


def _supply(minimum: int, lowest: int, maximum: int) -> dict[str, Limits]:
    """Return the voltage limits; `lowest` is the smallest value that either of them takes."""
    return {
        "max_voltage_limit": (maximum, lowest, maximum),
        "min_voltage_limit": (minimum, lowest, maximum),
    }


_5_V: Final = _supply(35, 31, 70)
_X330_12_V: Final = _supply(55, 55, 140) | {"pwm_slope": (255, 1, 255)}


def _model(
    name: str,
    number: int,
    family: _Family,
    *,
    stall_nm: float,
    stall_a: float,
    no_load_rev_min: float,
    velocity_limit: int,
    changes: Mapping[str, Limits] = MappingProxyType({}),
    at_v: float = 12.0,
) -> ServoDatasheet:
    fastest = 1023 if family.indirect is LARGE_INDIRECT else 2047
    limits: dict[str, Limits] = {
        "model_number": (number, None, None),
        "velocity_limit": (velocity_limit, 0, fastest),
        **family.changes,
        **changes,
    }
    rows = sorted(_rows(family, limits), key=lambda row: row.address)
    return ServoDatasheet(
        name=name,
        number=number,
        registers=MappingProxyType({row.name: row for row in rows}),
        registers_by_address=MappingProxyType({row.address: row for row in rows}),
        operating_modes=_VOLTAGE_MODES
        if family.current_unit_a is None
        else frozenset(OperatingMode),
        stall_torque_nm=stall_nm,
        stall_current_a=stall_a,
        no_load_speed_rad_s=no_load_rev_min * 2 * pi / 60,
        voltage_v=at_v,
        current_unit_a=family.current_unit_a,
        min_firmware_fast_sync=family.fast_sync,
        min_firmware_watchdog=family.watchdog,
        indirect=family.indirect,
    )


def _rows(family: _Family, limits: Mapping[str, Limits]) -> list[Register]:
    rows = []
    for row in COMMON + family.extra:
        initial, minimum, maximum = limits.get(row.name, (row.initial, row.minimum, row.maximum))
        if row.name not in family.lacks:
            rows.append(replace(row, initial=initial, minimum=minimum, maximum=maximum))
    return rows


# fmt: off
_ALL: Final = (
    _model("XM430-W350", 1020, _X430, stall_nm=4.1, stall_a=2.3, no_load_rev_min=46,
           velocity_limit=200),
    _model("XM430-W210", 1030, _X430, stall_nm=3.0, stall_a=2.3, no_load_rev_min=77,
           velocity_limit=330),
    _model("XH430-W210", 1010, replace(_X430, lacks=_LATE_REGISTERS), stall_nm=2.5, stall_a=1.3,
           no_load_rev_min=50, velocity_limit=360,
           changes=_current(648) | {"position_p_gain": _gain(900)}),
    _model("XM540-W270", 1120, _X540, stall_nm=10.6, stall_a=4.4, no_load_rev_min=30,
           velocity_limit=128, changes=_current(2047)),
    _model("XH540-W150", 1110, _X540, stall_nm=7.1, stall_a=4.9, no_load_rev_min=70,
           velocity_limit=300, changes=_current(2047)),
    _model("XH540-W270", 1100, _X540, stall_nm=9.9, stall_a=4.9, no_load_rev_min=39,
           velocity_limit=167, changes=_current(2047)),
    _model("XL430-W250", 1060, _XL430, stall_nm=1.5, stall_a=1.4, no_load_rev_min=61,
           velocity_limit=265, changes=_supply(60, 60, 140) | _gains(1000, 100, 4000, 640)
           | {"temperature_limit": (72, 0, 100)}),
    _model("XC430-W150", 1070, _XL430, stall_nm=1.6, stall_a=1.4, no_load_rev_min=106,
           velocity_limit=460, changes=_supply(60, 60, 160) | _gains(1920, 100, 0, 460)
           | {"moving_threshold": (20, 0, 1023)}),
    _model("2XL430-W250", 1090, _2X430, stall_nm=1.5, stall_a=1.4, no_load_rev_min=61,
           velocity_limit=250, changes=_supply(60, 60, 140) | _gains(1800, 100, 2000, 640)
           | {"temperature_limit": (72, 0, 100)}),
    _model("2XC430-W250", 1160, _2X430, stall_nm=1.8, stall_a=1.4, no_load_rev_min=64,
           velocity_limit=275, changes=_supply(60, 60, 160) | _gains(1920, 100, 0, 700)),
    _model("XL330-M077", 1190, _X330, stall_nm=0.215, stall_a=1.47, no_load_rev_min=383, at_v=5.0,
           velocity_limit=1620, changes=_5_V | _current(1750) | _gains(400, 40, 0, 400)
           | {"position_i_gain": _gain(400), "shutdown": (53, 0, 61)}),
    _model("XL330-M288", 1200, _X330, stall_nm=0.52, stall_a=1.47, no_load_rev_min=103, at_v=5.0,
           velocity_limit=445, changes=_5_V | _current(1750) | _gains(1600, 180, 0, 400)
           | {"shutdown": (53, 0, 61)}),
    _model("XC330-M181", 1230, _X330, stall_nm=0.60, stall_a=1.80, no_load_rev_min=129, at_v=5.0,
           velocity_limit=545, changes=_5_V | _current(2352) | _gains(1400, 100, 500, 1200)),
    _model("XC330-M288", 1240, _X330, stall_nm=0.93, stall_a=1.80, no_load_rev_min=81, at_v=5.0,
           velocity_limit=350, changes=_5_V | _current(2352) | _gains(1600, 50, 500, 1100)),
    _model("XC330-T181", 1210, _X330, stall_nm=0.80, stall_a=0.88, no_load_rev_min=113,
           velocity_limit=510, changes=_X330_12_V | _current(910) | _gains(1200, 40, 0, 900)),
    _model("XC330-T288", 1220, _X330, stall_nm=1.00, stall_a=0.88, no_load_rev_min=71,
           velocity_limit=320, changes=_X330_12_V | _current(910) | _gains(1200, 40, 0, 900)),
)
# fmt: on

MODELS: Final[Mapping[str, ServoDatasheet]] = MappingProxyType(
    {model.name: model for model in _ALL}
)
MODELS_BY_NUMBER: Final[Mapping[int, ServoDatasheet]] = MappingProxyType(
    {model.number: model for model in _ALL}
)
