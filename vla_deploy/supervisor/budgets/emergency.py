"""Find what cannot wait for the ladder: memory nearly out, critical heat, failing supply."""

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Final

from platforms.probes import Reading

_MB: Final = 1_000_000
# Below this the kernel soon kills processes of its choice, or the board hangs.
LEAST_MEMORY_RATIO: Final = 0.02
LEAST_MEMORY_MB: Final = 64
# At its critical trip point the kernel switches the board off while the robot moves.
CRITICAL_MARGIN_C: Final = 3.0
_ZONE: Final = "temperature_c."
_EVENTS: Final = "throttle_events."
_SUPPLY_FAULTS: Final = {f"{_EVENTS}oc1": "under-voltage", f"{_EVENTS}oc2": "over-current"}
_HINT: Final = f"{_EVENTS}oc3"  # peaks are ordinary under heavy load


def critical_trips_c(root: Path) -> dict[str, float]:
    """Return the critical trip point of each thermal zone that declares one, named as its probe."""
    trips: dict[str, float] = {}
    names: set[str] = set()
    for zone in sorted((root / "sys/class/thermal").glob("thermal_zone*")):
        name = _type(zone)
        name = f"{name}_{zone.name.removeprefix('thermal_zone')}" if name in names else name
        names.add(name)
        critical_c = _critical_c(zone)
        if critical_c is not None:
            trips[name] = critical_c
    return trips


def _type(zone: Path) -> str:
    try:
        return (zone / "type").read_text().strip() or zone.name
    except OSError:
        return zone.name


def _critical_c(zone: Path) -> float | None:
    for kind in sorted(zone.glob("trip_point_*_type")):
        temperature = kind.with_name(kind.name.replace("_type", "_temp"))
        try:
            if kind.read_text().strip() == "critical":
                return int(temperature.read_text()) / 1000
        except (OSError, ValueError):
            continue  # a trip point that cannot be read now declares nothing
    return None


class Emergencies:
    """Judge what the probes read against what the board itself calls critical.

    `read_trips_c` is called again when a zone has a temperature for the first time: zones may
    appear late.
    """

    def __init__(self, read_trips_c: Callable[[], Mapping[str, float]]) -> None:
        self.hint = ""
        self._read_trips_c = read_trips_c
        self._trips_c: dict[str, float] = {}
        self._zones: set[str] = set()

    def judge(self, readings: Mapping[str, Reading]) -> str:
        """Return why the robot must stop at once, or ""; `hint` names load peaks."""
        peaks = _value(readings, _HINT)
        self.hint = f"{peaks:g} peaks of current throttled the board" if peaks else ""
        return "; ".join([*_memory(readings), *self._heat(readings), *_supply(readings)])

    def _heat(self, readings: Mapping[str, Reading]) -> list[str]:
        zones = {
            name.removeprefix(_ZONE)
            for name, reading in readings.items()
            if name.startswith(_ZONE) and reading.value is not None
        }
        if not zones <= self._zones:
            self._zones |= zones
            self._trips_c.update(self._read_trips_c())
        hot = []
        for zone, critical_c in self._trips_c.items():
            value = _value(readings, f"{_ZONE}{zone}")
            if value is not None and value >= critical_c - CRITICAL_MARGIN_C:
                hot.append(f"{zone} at {value:g} degC, the board goes off at {critical_c:g} degC")
        return hot


def _value(readings: Mapping[str, Reading], name: str) -> float | None:
    reading = readings.get(name)
    return reading.value if reading is not None else None


def _memory(readings: Mapping[str, Reading]) -> list[str]:
    available = _value(readings, "memory_available_bytes")
    total = _value(readings, "memory_total_bytes")
    if available is None or total is None:
        return []
    least_bytes = max(LEAST_MEMORY_MB * _MB, LEAST_MEMORY_RATIO * total)
    if available >= least_bytes:
        return []
    return [
        f"{available / _MB:.0f} MB of memory available, at least {least_bytes / _MB:.0f} MB "
        "are needed"
    ]


def _supply(readings: Mapping[str, Reading]) -> list[str]:
    return [
        f"{what} at the board's supply ({name.removeprefix(_EVENTS)}, {rise:g} times)"
        for name, what in _SUPPLY_FAULTS.items()
        if (rise := _value(readings, name))
    ]
