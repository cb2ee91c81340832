"""Estimate the charge from the voltage, and judge what a charge means; pure."""

from dataclasses import dataclass
from enum import IntEnum
from itertools import pairwise
from typing import Final

from drivers.clock import NS_PER_S
from vla_deploy.robots.battery_settings import BatterySettings

HOLD_NS: Final = 5 * NS_PER_S
"""A charge must be lower for so long: one bad reading ends no plan."""
RELEASE_RATIO: Final = 0.03
"""So far above its ratio a level ends."""


class BatteryLevel(IntEnum):
    """Order what a charge means."""

    USUAL = 0
    LOW = 1
    CRITICAL = 2


@dataclass(frozen=True, slots=True, kw_only=True)
class LevelState:
    """Hold the level in force, and since when the charge has meant a worse one."""

    level: BatteryLevel = BatteryLevel.USUAL
    worse_since_ns: int | None = None


def estimated_charge(voltage_v: float, settings: BatterySettings) -> float | None:
    """Return the charge that a resting pack of this voltage has; None without a curve."""
    if not settings.cell_curve:
        return None
    cell_v = voltage_v / settings.cells
    if cell_v <= settings.cell_curve[0][0]:
        return 0.0
    for (below_v, below), (above_v, above) in pairwise(settings.cell_curve):
        if cell_v <= above_v:
            return below + (above - below) * (cell_v - below_v) / (above_v - below_v)
    return 1.0


def judged(
    before: LevelState, charge_ratio: float | None, settings: BatterySettings, now_ns: int
) -> LevelState:
    """Return the level after a reading; an unknown charge changes nothing."""
    if charge_ratio is None:
        return before
    level = _level_of(charge_ratio, settings)
    if level > before.level:
        since_ns = now_ns if before.worse_since_ns is None else before.worse_since_ns
        if now_ns - since_ns < HOLD_NS:
            return LevelState(level=before.level, worse_since_ns=since_ns)
        return LevelState(level=level)
    released = _level_of(charge_ratio - RELEASE_RATIO, settings)
    return LevelState(level=min(before.level, released))


def _level_of(charge_ratio: float, settings: BatterySettings) -> BatteryLevel:
    if charge_ratio <= settings.critical_ratio:
        return BatteryLevel.CRITICAL
    return BatteryLevel.LOW if charge_ratio <= settings.low_ratio else BatteryLevel.USUAL
