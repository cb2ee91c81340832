"""Load what one kind of computer can do: rates, watchdogs, priorities, declared budgets."""

import tomllib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from platforms.errors import ProfileError

PROFILES = Path(__file__).parent / "profiles"
_PROCESSES = ("supervisor", "control", "perception", "planner", "executor", "twin")
_MIN_WATCHDOG_PERIODS = 3


@dataclass(frozen=True, slots=True, kw_only=True)
class ProcessBudget:
    """Declare what one process may use; `cpu_ratio` counts in cores."""

    memory_mb: float
    cpu_ratio: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Profile:
    """Declare how the stack runs on one kind of computer.

    `bus_watchdog_s` and `can_heartbeat_s` say how long servos and wheel drives carry on when
    control is silent. `realtime_priority` is the SCHED_FIFO priority of control, 0 for none.
    """

    name: str
    control_rate_hz: float
    bus_watchdog_s: float
    can_heartbeat_s: float
    camera_rate_hz: float
    perception_rate_hz: float
    executor_rate_hz: float
    realtime_priority: int
    budgets: Mapping[str, ProcessBudget]


@dataclass(frozen=True, slots=True)
class _Range:
    """Allow numbers from `low` to `high`."""

    low: float
    high: float
    unit: str
    integer: bool = False

    def __str__(self) -> str:
        kind = "an integer" if self.integer else "a number"
        return f"{kind} from {self.low:g} to {self.high:g} {self.unit}".rstrip()

    def allows(self, value: object) -> bool:
        """Tell whether a TOML value is such a number."""
        numeric = isinstance(value, int if self.integer else int | float)
        return numeric and not isinstance(value, bool) and self.low <= value <= self.high  # type: ignore[operator]


_KEYS: Mapping[str, _Range] = {
    "control_rate_hz": _Range(50, 1000, "Hz"),
    "bus_watchdog_s": _Range(0.02, 2.54, "s"),  # the servos' register: 1..127 times 20 ms
    "can_heartbeat_s": _Range(0.01, 2.0, "s"),
    "camera_rate_hz": _Range(1, 60, "Hz"),
    "perception_rate_hz": _Range(0.5, 60, "Hz"),
    "executor_rate_hz": _Range(5, 200, "Hz"),
    "realtime_priority": _Range(0, 80, "", integer=True),  # leaves the kernel's own threads ahead
}
_BUDGET_KEYS: Mapping[str, _Range] = {
    "memory_mb": _Range(1, 131072, "MB"),
    "cpu_ratio": _Range(0.01, 64, "cores"),
}


def load_profile(name_or_path: str | Path) -> Profile:
    """Load a profile by its name, or by a path that ends in .toml.

    Raises:
        ProfileError: no such profile, or it has faults; every fault is reported.
    """
    path = _locate(str(name_or_path))
    try:
        document = tomllib.loads(path.read_text())
    except (tomllib.TOMLDecodeError, UnicodeDecodeError, OSError) as error:
        raise ProfileError((f"{path}: expected a TOML file: {error}",)) from error
    faults = tuple(f"{path}: {fault}" for fault in _faults(document))
    if faults:
        raise ProfileError(faults)
    return _build(path.stem, document)


def _locate(name: str) -> Path:
    if name.endswith(".toml"):
        return Path(name)
    path = PROFILES / f"{name}.toml"
    if "/" in name or not path.is_file():
        known = ", ".join(sorted(found.stem for found in PROFILES.glob("*.toml")))
        raise ProfileError((f"no profile {name!r}: choose {known}, or give a path to a .toml",))
    return path


def _faults(document: Mapping[str, Any]) -> Iterator[str]:
    scalars = {key: value for key, value in document.items() if key != "budgets"}
    yield from _table_faults("", scalars, _KEYS)
    budgets = document.get("budgets")
    if not isinstance(budgets, dict):
        yield f"budgets: expected a table for each of {', '.join(_PROCESSES)}, got {budgets!r}"
        return
    for name in sorted(budgets.keys() - set(_PROCESSES)):
        yield f"budgets.{name}: unknown process, expected one of {', '.join(_PROCESSES)}"
    for name in _PROCESSES:
        yield from _table_faults(f"budgets.{name}", budgets.get(name), _BUDGET_KEYS)
    yield from _cross_faults(document)


def _table_faults(where: str, table: object, keys: Mapping[str, _Range]) -> Iterator[str]:
    if not isinstance(table, dict):
        yield f"{where}: expected a table with {', '.join(keys)}, got {table!r}"
        return
    prefix = f"{where}." if where else ""
    for key in table.keys() - keys.keys():
        yield f"{prefix}{key}: unknown key, expected {', '.join(keys)}"
    for key, allowed in keys.items():
        if key not in table:
            yield f"{prefix}{key}: expected {allowed}, got nothing"
        elif not allowed.allows(table[key]):
            yield f"{prefix}{key}: expected {allowed}, got {table[key]!r}"


def _cross_faults(document: Mapping[str, Any]) -> Iterator[str]:
    rate_hz = document.get("control_rate_hz")
    if not _KEYS["control_rate_hz"].allows(rate_hz):
        return
    shortest_s = _MIN_WATCHDOG_PERIODS / rate_hz  # type: ignore[operator]
    for key in ("bus_watchdog_s", "can_heartbeat_s"):
        value = document.get(key)
        if _KEYS[key].allows(value) and value < shortest_s:  # type: ignore[operator]
            yield (
                f"{key}: expected at least {_MIN_WATCHDOG_PERIODS} control periods "
                f"({shortest_s:g} s), got {value!r}"
            )


def _build(name: str, document: Mapping[str, Any]) -> Profile:
    budgets = {process: ProcessBudget(**table) for process, table in document["budgets"].items()}
    return Profile(**{**document, "name": name, "budgets": budgets})
