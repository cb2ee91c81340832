"""Declare the robot's battery: the `[battery]` table of the robot file."""

import itertools
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from enum import StrEnum
from typing import Any, Final

from vla_deploy.runtime.table_schema import (
    POSITIVE,
    TEXT,
    Shape,
    TableFault,
    ValueCheck,
    integer,
    is_number,
    number,
    one_of,
)


class BatterySource(StrEnum):
    """Name what measures the battery."""

    POWER_SUPPLY = "power_supply"
    """A gauge that the kernel knows: /sys/class/power_supply."""
    SERVOS = "servos"
    """The supply voltage that the servos measure; the charge is estimated from it."""


class AtLow(StrEnum):
    """Name what the robot does when its battery is low."""

    ANNOUNCE = "announce"
    CHARGE = "charge"


LOW_RATIO: Final = 0.25
CRITICAL_RATIO: Final = 0.1
CellCurve = tuple[tuple[float, float], ...]
"""Open-circuit voltage of one cell (V) and the charge (0 to 1) that it means, both rising."""


@dataclass(frozen=True, slots=True, kw_only=True)
class BatterySettings:
    """Describe the pack, what measures it, and what a low one means.

    `cells` are in series. `supply` is the gauge's folder below /sys/class/power_supply; without it
    the first battery there is taken. `station` is the place where the robot charges.
    """

    source: BatterySource
    capacity_wh: float
    cells: int
    cell_curve: CellCurve = ()
    supply: str = ""
    low_ratio: float = LOW_RATIO
    critical_ratio: float = CRITICAL_RATIO
    at_low: AtLow = AtLow.ANNOUNCE
    station: str = ""


_RATIO: Final = number(0.0, 1.0).optional
_FOLDER: Final = ValueCheck(
    expected="a folder's name below /sys/class/power_supply",
    holds=lambda value: (
        isinstance(value, str) and value not in ("", ".", "..") and "/" not in value
    ),
    is_optional=True,
)
CELL_CURVE: Final = ValueCheck(
    expected="[volts, charge] pairs, both rising, from a charge of 0.0 to one of 1.0",
    holds=lambda value: (
        isinstance(value, list)
        and len(value) > 1
        and all(
            isinstance(one, list) and len(one) == 2 and all(map(is_number, one)) for one in value
        )
        and all(low[0] < high[0] and low[1] < high[1] for low, high in itertools.pairwise(value))
        and value[0][0] > 0
        and (value[0][1], value[-1][1]) == (0, 1)
    ),
    is_optional=True,
)
BATTERY: Final[Shape] = {
    "source": one_of(*(one.value for one in BatterySource)),
    "capacity_wh": POSITIVE,
    "cells": integer(1, 32),
    "cell_curve": CELL_CURVE,
    "supply": _FOLDER,
    "low_ratio": _RATIO,
    "critical_ratio": _RATIO,
    "at_low": one_of(*(one.value for one in AtLow)).optional,
    "station": TEXT.optional,
}


def battery_is_usable(document: Mapping[str, Any]) -> Iterator[TableFault]:
    """Yield a fault where keys of `[battery]` do not fit each other or the robot's places."""
    battery = document.get("battery")
    if isinstance(battery, dict):
        for check in _CHECKS:
            yield from check(battery, document)


def _ratios_are_ordered(battery: Mapping[str, Any], _: Mapping[str, Any]) -> Iterator[TableFault]:
    low = battery.get("low_ratio", LOW_RATIO)
    critical = battery.get("critical_ratio", CRITICAL_RATIO)
    if is_number(low) and is_number(critical) and not critical < low:
        yield TableFault(
            key="battery.critical_ratio", got=repr(critical), expected=f"below low_ratio {low}"
        )


def _curve_is_there(battery: Mapping[str, Any], _: Mapping[str, Any]) -> Iterator[TableFault]:
    if battery.get("source") == BatterySource.SERVOS and "cell_curve" not in battery:
        yield TableFault(
            key="battery.cell_curve",
            got="nothing",
            expected=f"{CELL_CURVE.expected}: servos measure a voltage only",
        )


def _supply_is_used(battery: Mapping[str, Any], _: Mapping[str, Any]) -> Iterator[TableFault]:
    if battery.get("source") == BatterySource.SERVOS and "supply" in battery:
        yield TableFault(
            key="battery.supply", got=repr(battery["supply"]), expected='source = "power_supply"'
        )


def _station_is_place(
    battery: Mapping[str, Any], document: Mapping[str, Any]
) -> Iterator[TableFault]:
    home = document.get("home")
    places = home.get("places") if isinstance(home, dict) else None
    station = battery.get("station")
    if isinstance(station, str) and isinstance(places, dict) and station not in places:
        yield TableFault(
            key="battery.station",
            got=repr(station),
            expected=f"a place: {', '.join(sorted(places))}",
        )
    if battery.get("at_low") == AtLow.CHARGE and "station" not in battery:
        yield TableFault(
            key="battery.station", got="nothing", expected='a place, as at_low = "charge" needs it'
        )


_CHECKS: Final[
    tuple[Callable[[Mapping[str, Any], Mapping[str, Any]], Iterator[TableFault]], ...]
] = (_ratios_are_ordered, _curve_is_there, _supply_is_used, _station_is_place)
