"""Type what the supervisor and all processes agree on: processes, budgets, profiles."""

from collections.abc import Mapping
from typing import Any, Literal, NotRequired, TypedDict

ProcessStateName = Literal[
    "off",
    "waiting",
    "starting",
    "ready",
    "aborting",
    "back-off",
    "given up",
    "stopping",
    "stopped",
]
ActivityName = Literal[
    "idle", "listening", "processing", "navigating", "manipulating", "completed", "stopped"
]
LadderActionName = Literal["slow", "smaller_model", "suspend", "restart", "protective_stop"]
AnsweredPhaseName = Literal["prepare", "commit", "validate", "rollback"]


class UsageDocument(TypedDict):
    """Say what a process uses, CPU in cores; null was not measured yet."""

    memory_mb: float | None
    rss_mb: float | None
    cpu_ratio: float | None
    cpu_s: float | None


class WatchedTopic(TypedDict):
    """Say how a topic that a process always writes is written."""

    topic: str
    age_s: float
    rate_hz: float | None
    least_hz: float
    faults: list[str]


class ProcessRow(UsageDocument):
    """Describe one process; `fresh` is whether it has written the topic that shows it is ready."""

    name: str
    state: ProcessStateName
    pid: int | None
    fresh: bool
    restarts: int
    exit_code: int | None
    reason: str
    topics: list[WatchedTopic]
    alarms: list[str]


class ProcessTable(TypedDict):
    """Hold the run and its processes; `refusal` is why no command is taken, "" where they are."""

    run_id: str
    robot: str
    profile: str
    twin: bool
    supervisor_pid: int
    refusal: str
    processes: list[ProcessRow]
    supervisor: UsageDocument
    peak_memory_mb: float | None
    memory_kind: str | None


class ActivityDocument(TypedDict):
    """Say what the robot does, since when, and what stops it; "" where nothing does."""

    activity: ActivityName
    stopped_by: str
    since_ns: int


class ResourceDirectives(TypedDict):
    """Say what the budgets ask of processes, by their names: share of the rate, model, rest."""

    rate_ratio: dict[str, float]
    model_tier: dict[str, int]
    suspended: list[str]


class BudgetRow(TypedDict):
    """Say how one line of the budgets stands; a line of the whole computer has no process."""

    process: str | None
    metric: str
    measured: float | None
    limit: float
    at_least: bool
    state: Literal["ok", "rising", "over", "falling", "missing"]
    over: bool
    since_s: float
    reason: str


class LadderStepDocument(TypedDict):
    """Name a step of the ladder."""

    action: LadderActionName
    process: str | None
    ratio: float


class TakenStep(LadderStepDocument):
    """Say since when and why a step is in force."""

    since_s: float
    why: str


class StepChange(LadderStepDocument):
    """Say when and why a step was taken or undone."""

    taken: bool
    ago_s: float
    why: str


class LadderDocument(TypedDict):
    """Hold the steps in force, their number, the latest changes, and counts of all."""

    step: int
    taken: list[TakenStep]
    history: list[StepChange]
    counts: dict[str, int]


class EnforcementRow(TypedDict):
    """Say how a process' limits are enforced."""

    process: str
    memory: str
    cpu: str


class BudgetDocument(TypedDict):
    """Hold every budget's line, the ladder, and whether the robot must stop, with the reason."""

    rows: list[BudgetRow]
    ladder: LadderDocument
    enforced: list[EnforcementRow]
    hint: str
    stop: bool
    reason: str


class BoardDocument(TypedDict):
    """Hold the computer's readings by name, and why one is missing."""

    readings: dict[str, float]
    missing: dict[str, str]


class BudgetStop(TypedDict):
    """Say whether a budget demands a protective stop, and why."""

    stop: bool
    reason: str


class ProfileRequestMessage(TypedDict):
    """Ask for a profile by name or path; a dry run stops before it is put in force."""

    request_id: str
    profile: str
    allow_restart: NotRequired[bool]
    dry_run: NotRequired[bool]


class _ChangeMessage(TypedDict):
    change_id: int
    profile: str


class PrepareProfile(_ChangeMessage):
    """Have processes prepare a profile, whose values come along."""

    phase: Literal["prepare"]
    values: Mapping[str, Any]


class WatchProfile(_ChangeMessage):
    """Have processes measure their rate.

    `restarted` has the share of its rate that a restarted process reached before, `again` who
    counts anew.
    """

    phase: Literal["watch"]
    restarted: Mapping[str, float]
    again: list[str]


class ProfilePhase(_ChangeMessage):
    """Have processes go through a phase that needs no more."""

    phase: Literal["commit", "validate", "keep", "rollback"]


ProfileChangeMessage = PrepareProfile | WatchProfile | ProfilePhase


class ProfileAnswer(TypedDict):
    """Say whether a process went along with a phase, or why not and whether a restart helps."""

    change_id: int
    process: str
    phase: AnsweredPhaseName
    ok: bool
    reason: str
    restart: bool
    pace_ratio: float


class ConcludedRequest(TypedDict, total=False):
    """Say how the last request ended; empty before the first."""

    request_id: str
    profile: str
    outcome: Literal["kept", "would work", "refused", "rolled back"]
    reason: str
    took_s: float


class ProfileStatus(TypedDict):
    """Hold the profile in force, the phase and target of a change, "" where there is none."""

    profile: str
    begun_with: str
    phase: Literal["", "prepare", "set power mode", "commit", "watch", "validate", "rollback"]
    target: str
    last: ConcludedRequest
    fault: str


class BatteryDocument(TypedDict):
    """Describe the battery; what is not known is null, and `missing` says why by its key.

    `current_a` is positive into the battery. A charge that `is_estimate` was read off the voltage.
    `low` and `critical` follow the robot file's ratios, and stay while the charge is not known.
    """

    source: Literal["power_supply", "servos"]
    stamp_ns: int
    voltage_v: float | None
    charge_ratio: float | None
    is_estimate: bool
    current_a: float | None
    is_charging: bool | None
    low: bool
    critical: bool
    missing: dict[str, str]
