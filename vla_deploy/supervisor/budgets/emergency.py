"""Find what cannot wait for the ladder: memory nearly out, critical heat, failing supply."""

from collections.abc import Mapping
from pathlib import Path
from typing import Final

from platforms.probes import Reading

_MB: Final = 1_000_000
# Below this the kernel soon kills whom it likes, or the board hangs.
LEAST_MEMORY_RATIO: Final = 0.02
LEAST_MEMORY_MB: Final = 64
# At its critical trip point the kernel switches the board off, with the robot in motion.
CRITICAL_MARGIN_C: Final = 3.0
_EVENTS: Final = "throttle_events."
_SUPPLY_FAULTS: Final = {f"{_EVENTS}oc1": "under-voltage", f"{_EVENTS}oc2": "over-current"}
_HINT: Final = f"{_EVENTS}oc3"  # peaks are ordinary under heavy load


def critical_trips_c(root: Path) -> dict[str, float]:
    """Return the critical trip point of each thermal zone that declares one."""
    trips: dict[str, float] = {}
    for zone in sorted((root / "sys/class/thermal").glob("thermal_zone*")):
        for kind in zone.glob("trip_point_*_type"):
            temperature = kind.with_name(kind.name.replace("_type", "_temp"))
            try:
                if kind.read_text().strip() == "critical":
                    name = (zone / "type").read_text().strip()
                    trips[name] = int(temperature.read_text()) / 1000
            except (OSError, ValueError):
                continue  # a zone that cannot be read now declares nothing
    return trips


class Emergencies:
    """Judge what the probes read against what the board itself calls critical."""

    def __init__(self, trips_c: Mapping[str, float]) -> None:
        self.hint = ""
        self._trips_c = trips_c

    def judge(self, readings: Mapping[str, Reading]) -> str:
        """Return why the robot must stop at once, or nothing; `hint` tells of load peaks."""
        peaks = _value(readings, _HINT)
        self.hint = f"{peaks:g} peaks of current throttled the board" if peaks else ""
        return "; ".join([*_memory(readings), *self._heat(readings), *_supply(readings)])

    def _heat(self, readings: Mapping[str, Reading]) -> list[str]:
        hot = []
        for zone, critical_c in self._trips_c.items():
            value = _value(readings, f"temperature_c.{zone}")
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
