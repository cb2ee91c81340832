"""Declare budgets, and the ladder of measures against their excess."""

from dataclasses import dataclass
from enum import StrEnum


class LadderAction(StrEnum):
    """Name a measure; declared here in rising order."""

    SLOW = "slow"
    SMALLER_MODEL = "smaller_model"
    SUSPEND = "suspend"
    RESTART = "restart"
    PROTECTIVE_STOP = "protective_stop"


@dataclass(frozen=True, slots=True, kw_only=True)
class ProcessBudget:
    """Declare what one process may use; `cpu_ratio` counts in cores."""

    memory_mb: float
    cpu_ratio: float


@dataclass(frozen=True, slots=True, kw_only=True)
class TotalBudget:
    """Declare what the stack may use in total; None is no limit, `disk_free_mb` is a lower one.

    `memory_mb` is what all processes use together, `temperature_c` the hottest zone.
    """

    memory_mb: float
    cpu_ratio: float
    disk_free_mb: float
    power_w: float | None = None
    temperature_c: float | None = None
    gpu_memory_mb: float | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class LadderStep:
    """Declare one step; `process` is empty for a protective stop, which concerns the robot.

    `ratio` is the share of its rate that a slowed process keeps.
    """

    action: LadderAction
    process: str = ""
    ratio: float = 1.0


@dataclass(frozen=True, slots=True, kw_only=True)
class LadderTiming:
    """Declare how long an excess lasts before the next step, and its end before a step back.

    An excess has ended when what is used is below `release_ratio` of its budget.
    """

    rise_s: float
    fall_s: float
    release_ratio: float
