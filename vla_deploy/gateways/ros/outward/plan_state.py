"""Judge from what the processes say of themselves how the newest plan stands."""

from collections.abc import Mapping
from enum import StrEnum
from typing import Any, Final

Document = Mapping[str, Any] | None


class PlanState(StrEnum):
    """Name how the newest plan stands."""

    IDLE = "idle"
    PLANNING = "planning"
    EXECUTING = "executing"
    PAUSED = "paused"
    BLOCKED = "blocked"
    COMPLETED = "completed"
    FAILED = "failed"


_PAUSED: Final = "paused"


def plan_state_of(
    control: Document, executor: Document, planner: Document, *, has_succeeded: bool | None = None
) -> PlanState:
    """Return what the newest documents say; None is a process that is silent.

    `has_succeeded` is of the command that ended last, None before any has.
    """
    executing = str((executor or {}).get("state") or "")
    if executing == "recovering":
        return PlanState.BLOCKED
    if executing == _PAUSED:
        return PlanState.PAUSED
    if executing == "executing":
        is_armed = (control or {}).get("state") == "armed"
        return PlanState.EXECUTING if is_armed else PlanState.PAUSED
    if (planner or {}).get("question"):
        return PlanState.PAUSED
    if (planner or {}).get("commands"):
        return PlanState.PLANNING
    if has_succeeded is None:
        return PlanState.IDLE
    # How the last one ended stays until the next.
    return PlanState.COMPLETED if has_succeeded else PlanState.FAILED
