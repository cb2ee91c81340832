"""Hold one measured number, or the reason why there is none."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Protocol

from platforms.tree import ValueMissing


@dataclass(frozen=True, slots=True, kw_only=True)
class Reading:
    """Hold one number; `value` is None where it is missing, and `reason` then says why."""

    name: str
    value: float | None
    unit: str
    reason: str = ""


class ReadingSource(Protocol):
    """Give the readings of one place in the system."""

    def readings(self) -> Iterable[Reading]:
        """Return the present readings, those that are missing included."""


def measure(name: str, unit: str, take: Callable[[], float]) -> Reading:
    """Take one number; what cannot be had becomes a reading with a reason."""
    try:
        return Reading(name=name, value=take(), unit=unit)
    except ValueMissing as missing:
        return lacking(name, unit, str(missing))


def lacking(name: str, unit: str, because: str) -> Reading:
    """Return a reading without a value."""
    return Reading(name=name, value=None, unit=unit, reason=f"missing, because {because}")
