"""Declare how the stack runs on one kind of computer."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from platforms.errors import ProfileError
from platforms.ladder import (
    LadderAction,
    LadderStep,
    LadderTiming,
    ProcessBudget,
    TotalBudget,
)
from platforms.profile_check import cross_faults
from platforms.profile_schema import schema_faults
from platforms.profile_source import PROFILES, ProfileSource, Table, read_source

__all__ = [
    "PROFILES",
    "BoardLimits",
    "ModelChoice",
    "PlanningSettings",
    "ProcessSettings",
    "Profile",
    "SpeechSettings",
    "load_profile",
    "profile_from",
    "profile_names",
]


@dataclass(frozen=True, slots=True, kw_only=True)
class BoardLimits:
    """Declare what the computer has at least; a profile may not ask for more."""

    cpu_count: int
    memory_mb: float


@dataclass(frozen=True, slots=True, kw_only=True)
class ProcessSettings:
    """Declare how the kernel runs one process; an empty `affinity` leaves every CPU.

    `threads` is how many of its own a numeric library of that process may start.
    """

    affinity: tuple[int, ...]
    nice: int
    threads: int


@dataclass(frozen=True, slots=True, kw_only=True)
class ModelChoice:
    """Declare which models may play one role, the best first, and where they run.

    `providers` are execution providers in order of preference. Running on the CPU where it is not
    listed is an error unless `cpu_fallback`. `memory_arena` keeps what a run needed for the next
    one: faster, and never given back. Where one is `required`, a process does not start without it.
    """

    tiers: tuple[str, ...]
    providers: tuple[str, ...]
    precision: str
    threads: int
    cpu_fallback: bool
    memory_arena: bool
    required: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class SpeechSettings:
    """Declare what a spoken phrase is, and how surely it must be understood.

    A phrase ends after `end_silence_s`, after `unfinished_silence_s` where its words so far cannot
    be all. `pre_roll_s` before its first sound belongs to it. `beam` is how many readings the
    recogniser follows at once; what it understands below `least_confidence` is asked again.
    `stop_words` says how easily a spoken stop is taken for one: low, normal, high, or off.
    """

    shortest_phrase_s: float
    longest_phrase_s: float
    end_silence_s: float
    unfinished_silence_s: float
    pre_roll_s: float
    beam: int
    least_confidence: float
    stop_words: str


@dataclass(frozen=True, slots=True, kw_only=True)
class PlanningSettings:
    """Declare who plans what rules do not cover, and how long that may take.

    `servers` are names of `servers.toml`, asked in this order after the model on board and before
    the command parser. `within_s` is the time for all of them together. So many commands are
    `remembered` from run to run, 0 for none.
    """

    within_s: float
    servers: tuple[str, ...]
    remembered: int


@dataclass(frozen=True, slots=True, kw_only=True)
class Profile:
    """Declare how the stack runs on one kind of computer.

    `bus_watchdog_s` and `can_heartbeat_s` say how long servos and wheel drives carry on when
    control is silent. `realtime_priority` is the SCHED_FIFO priority of control, 0 for none; unless
    `realtime_required`, control quietly does without where the computer does not permit it.
    `power_mode` is a name of the board's nvpmodel.conf; empty leaves the mode as it is.
    `ros` puts every robot on this computer into a ROS 2 graph.
    """

    name: str
    control_rate_hz: float
    bus_watchdog_s: float
    can_heartbeat_s: float
    camera_rate_hz: float
    perception_rate_hz: float
    executor_rate_hz: float
    realtime_priority: int
    realtime_required: bool
    memory_lock: bool
    power_mode: str
    ros: bool
    board: BoardLimits
    processes: Mapping[str, ProcessSettings]
    speech: SpeechSettings
    planning: PlanningSettings
    models: Mapping[str, ModelChoice]
    budgets: Mapping[str, ProcessBudget]
    total: TotalBudget
    ladder: tuple[LadderStep, ...]
    ladder_timing: LadderTiming


def load_profile(name_or_path: str | Path) -> Profile:
    """Load a profile by its name, or by a path that ends in .toml.

    Raises:
        ProfileError: no such profile, or it has faults; every fault is reported.
    """
    return profile_from(read_source(name_or_path))


def profile_from(source: ProfileSource) -> Profile:
    """Validate what was read, completely.

    Raises:
        ProfileError: it has faults; every fault is reported with the file that it stands in.
    """
    faults = tuple(schema_faults(source.values)) or tuple(cross_faults(source.values))
    if faults:
        raise ProfileError(tuple(f"{source.file_of(fault.key)}: {fault}" for fault in faults))
    return _build(source.name, source.values)


def profile_names() -> tuple[str, ...]:
    """Return the names of the profiles that come with the software."""
    return tuple(sorted(path.stem for path in PROFILES.glob("*.toml")))


def _build(name: str, values: Table) -> Profile:
    budgets = dict(values["budgets"])
    tables = {
        "board": BoardLimits(**values["board"]),
        "processes": {
            process: ProcessSettings(**{**table, "affinity": tuple(table["affinity"])})
            for process, table in values["processes"].items()
        },
        "speech": SpeechSettings(**values["speech"]),
        "planning": PlanningSettings(
            **{**values["planning"], "servers": tuple(values["planning"]["servers"])}
        ),
        "models": {role: _model(table) for role, table in values.get("models", {}).items()},
        "total": TotalBudget(**budgets.pop("total")),
        "budgets": {process: ProcessBudget(**table) for process, table in budgets.items()},
        "ladder": tuple(
            LadderStep(**{**step, "action": LadderAction(step["action"])})
            for step in values["ladder"]
        ),
        "ladder_timing": LadderTiming(**values["ladder_timing"]),
    }
    return Profile(**{**values, **tables, "name": name})


def _model(table: Table) -> ModelChoice:
    lists = {key: tuple(table[key]) for key in ("tiers", "providers")}
    return ModelChoice(**{**table, **lists})
