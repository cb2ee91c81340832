"""Declare every key of a profile and what it may be."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Final, Protocol

from platforms.ladder import LadderAction
from platforms.profile_source import Table

PROCESSES: Final[tuple[str, ...]] = (
    "supervisor",
    "control",
    "stop_door",
    "perception",
    "speech",
    "planner",
    "executor",
    "recorder",
    "dashboard",
    "ros",
    "twin",
)
NODES: Final[tuple[str, ...]] = (
    "control",
    "perception",
    "speech",
    "planner",
    "executor",
    "recorder",
    "dashboard",
    "ros",
)
ROLES: Final = (
    "detector",
    "planner",
    "key_words",
    "voice_activity",
    "speech_to_text",
    "text_to_speech",
    "text_embedder",
)
PROVIDERS: Final = (
    "TensorrtExecutionProvider",
    "CUDAExecutionProvider",
    "CPUExecutionProvider",
)
_PRECISIONS: Final = ("fp32", "fp16", "int8", "int4")


@dataclass(frozen=True, slots=True, kw_only=True)
class ProfileFault:
    """Hold what is wrong with one key."""

    key: str
    text: str

    def __str__(self) -> str:
        return f"{self.key}: {self.text}"


class ValueRule(Protocol):
    """Say in words what a value may be, and whether one is."""

    def allows(self, value: object) -> bool:
        """Return whether a TOML value follows the rule."""
        ...


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
        numeric = isinstance(value, int if self.integer else int | float)
        return numeric and not isinstance(value, bool) and self.low <= value <= self.high  # type: ignore[operator]


class _Flag:
    def __str__(self) -> str:
        return "true or false"

    def allows(self, value: object) -> bool:
        return isinstance(value, bool)


class _Text:
    def __str__(self) -> str:
        return "a text"

    def allows(self, value: object) -> bool:
        return isinstance(value, str)


@dataclass(frozen=True, slots=True)
class _OneOf:
    choices: tuple[str, ...]

    def __str__(self) -> str:
        return f"one of {', '.join(self.choices)}"

    def allows(self, value: object) -> bool:
        return value in self.choices


@dataclass(frozen=True, slots=True)
class _ListOf:
    """Allow lists without repetition, empty ones only where `empty`."""

    rule: ValueRule
    empty: bool = False

    def __str__(self) -> str:
        return f"a list, each {self.rule}, none twice" + ("" if self.empty else ", not empty")

    def allows(self, value: object) -> bool:
        if not isinstance(value, list) or not (value or self.empty):
            return False
        return all(map(self.rule.allows, value)) and len({str(one) for one in value}) == len(value)


Keys = Mapping[str, ValueRule]
_MEMORY_MB: Final = _Range(1, 262_144, "MB")
_CORES: Final = _Range(0.01, 64, "cores")
_TOP: Keys = {
    "control_rate_hz": _Range(50, 1000, "Hz"),
    "bus_watchdog_s": _Range(0.02, 2.54, "s"),  # the servos' register: 1..127 times 20 ms
    "can_heartbeat_s": _Range(0.01, 2.0, "s"),
    "camera_rate_hz": _Range(1, 60, "Hz"),
    "perception_rate_hz": _Range(0.5, 60, "Hz"),
    "executor_rate_hz": _Range(5, 200, "Hz"),
    "realtime_priority": _Range(0, 80, "", integer=True),  # leaves the kernel's own threads ahead
    "realtime_required": _Flag(),
    "memory_lock": _Flag(),
    "power_mode": _Text(),
    "ros": _Flag(),
}
_SPEECH: Keys = {
    "shortest_phrase_s": _Range(0.05, 2, "s"),
    "longest_phrase_s": _Range(1, 29, "s"),  # Whisper hears 30 s at once
    "end_silence_s": _Range(0.1, 3, "s"),
    "unfinished_silence_s": _Range(0.1, 5, "s"),
    "pre_roll_s": _Range(0, 1, "s"),
    "beam": _Range(1, 10, "", integer=True),
    "least_confidence": _Range(0, 1, ""),
    "stop_words": _OneOf(("off", "low", "normal", "high")),
}
_BOARD: Keys = {"cpu_count": _Range(1, 256, "", integer=True), "memory_mb": _MEMORY_MB}
_SETTINGS: Keys = {
    "affinity": _ListOf(_Range(0, 255, "", integer=True), empty=True),
    "nice": _Range(-20, 19, "", integer=True),
    "threads": _Range(1, 64, "", integer=True),
}
_MODEL: Keys = {
    "tiers": _ListOf(_Text()),
    "providers": _ListOf(_OneOf(PROVIDERS)),
    "precision": _OneOf(_PRECISIONS),
    "threads": _Range(1, 64, "", integer=True),
    "cpu_fallback": _Flag(),
    "memory_arena": _Flag(),
}
_MODEL_OPTIONAL: Keys = {"required": _Flag()}
_BUDGET: Keys = {"memory_mb": _MEMORY_MB, "cpu_ratio": _CORES}
_TOTAL: Keys = {**_BUDGET, "disk_free_mb": _Range(0, 1e7, "MB")}
_TOTAL_OPTIONAL: Keys = {
    "power_w": _Range(1, 1000, "W"),
    "temperature_c": _Range(20, 110, "degC"),
    "gpu_memory_mb": _MEMORY_MB,
}
_STEP: Keys = {"action": _OneOf(tuple(LadderAction))}
_STEP_OPTIONAL: Keys = {"process": _OneOf(PROCESSES), "ratio": _Range(0.05, 1.0, "")}
_TIMING: Keys = {
    "rise_s": _Range(0.1, 600, "s"),
    "fall_s": _Range(0.1, 3600, "s"),
    "release_ratio": _Range(0.1, 1.0, ""),
}
_PLANNING: Keys = {
    "within_s": _Range(1, 300, "s"),
    "servers": _ListOf(_Text(), empty=True),
    "remembered": _Range(0, 100_000, "commands", integer=True),
}
_TABLES: Final = (
    "board", "processes", "speech", "planning", "models", "budgets", "ladder", "ladder_timing",
)  # fmt: skip


def schema_faults(values: Table) -> Iterator[ProfileFault]:
    """Find every key that is unknown, missing or out of its range."""
    plain = {key: value for key, value in values.items() if key not in _TABLES}
    yield from _table_faults("", plain, _TOP)
    yield from _table_faults("board", values.get("board"), _BOARD)
    yield from _group_faults("processes", values.get("processes"), NODES, _SETTINGS)
    yield from _table_faults("speech", values.get("speech"), _SPEECH)
    yield from _table_faults("planning", values.get("planning"), _PLANNING)
    yield from _model_faults(values.get("models", {}))
    yield from _budget_faults(values.get("budgets"))
    yield from _ladder_faults(values.get("ladder"))
    yield from _table_faults("ladder_timing", values.get("ladder_timing"), _TIMING)


def _model_faults(models: object) -> Iterator[ProfileFault]:
    given = tuple(role for role in ROLES if isinstance(models, dict) and role in models)
    yield from _group_faults("models", models, given, _MODEL, _MODEL_OPTIONAL, known=ROLES)


def _budget_faults(budgets: object) -> Iterator[ProfileFault]:
    processes: object = budgets
    if isinstance(budgets, dict):
        processes = {name: table for name, table in budgets.items() if name != "total"}
        total = budgets.get("total")
        yield from _table_faults("budgets.total", total, _TOTAL, _TOTAL_OPTIONAL)
    yield from _group_faults("budgets", processes, PROCESSES, _BUDGET)


def _ladder_faults(ladder: object) -> Iterator[ProfileFault]:
    if not isinstance(ladder, list):
        text = f"expected a list of steps with {', '.join(_STEP)}, got {_shown(ladder)}"
        yield ProfileFault(key="ladder", text=text)
        return
    for number, step in enumerate(ladder):
        yield from _table_faults(f"ladder[{number}]", step, _STEP, _STEP_OPTIONAL)


def _group_faults(
    where: str,
    group: object,
    wanted: tuple[str, ...],
    keys: Keys,
    optional: Keys | None = None,
    known: tuple[str, ...] = (),
) -> Iterator[ProfileFault]:
    """Check tables of tables, one for each name wanted."""
    names = known or wanted
    if not isinstance(group, dict):
        text = f"expected a table for each of {', '.join(names)}, got {_shown(group)}"
        yield ProfileFault(key=where, text=text)
        return
    for name in sorted(group.keys() - set(names)):
        yield ProfileFault(
            key=f"{where}.{name}", text=f"unknown, expected one of {', '.join(names)}"
        )
    for name in wanted:
        yield from _table_faults(f"{where}.{name}", group.get(name), keys, optional)


def _table_faults(
    where: str, table: object, keys: Keys, optional: Keys | None = None
) -> Iterator[ProfileFault]:
    every = {**keys, **(optional or {})}
    if not isinstance(table, dict):
        text = f"expected a table with {', '.join(keys)}, got {_shown(table)}"
        yield ProfileFault(key=where, text=text)
        return
    prefix = f"{where}." if where else ""
    for key in table.keys() - every.keys():
        yield ProfileFault(key=f"{prefix}{key}", text=f"unknown key, expected {', '.join(every)}")
    for key, rule in every.items():
        if key in table and not rule.allows(table[key]):
            yield ProfileFault(key=f"{prefix}{key}", text=f"expected {rule}, got {table[key]!r}")
        elif key in keys and key not in table:
            yield ProfileFault(key=f"{prefix}{key}", text=f"expected {rule}, got nothing")


def _shown(value: object) -> str:
    return "nothing" if value is None else repr(value)
