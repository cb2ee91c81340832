"""Judge from what the processes say of themselves what the robot is doing, in one word."""

from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum
from typing import Any, Final

COMPLETED_S: Final = 3.0
"""How long a command that has ended well is shown before the robot is idle again."""
Document = Mapping[str, Any] | None


class CapstoneState(StrEnum):
    """Name what the robot does from hearing a command to its end."""

    IDLE = "IDLE"
    LISTENING = "LISTENING"
    PROCESSING = "PROCESSING"
    NAVIGATING = "NAVIGATING"
    MANIPULATING = "MANIPULATING"
    COMPLETED = "COMPLETED"
    STOPPED = "STOPPED"


class PlanState(StrEnum):
    """Name how the newest plan stands."""

    IDLE = "idle"
    PLANNING = "planning"
    EXECUTING = "executing"
    PAUSED = "paused"
    BLOCKED = "blocked"
    COMPLETED = "completed"
    FAILED = "failed"


_AT_REST: Final = frozenset({"", "disarmed", "stopping", "stopped", "fault"})
_UNDER_WAY: Final = frozenset({"executing", "recovering", "paused"})
_BY_SKILL: Final[Mapping[str, CapstoneState]] = {
    **dict.fromkeys(
        ("navigate_to", "charge", "move", "turn", "find_object"), CapstoneState.NAVIGATING
    ),
    **dict.fromkeys(
        ("pick_up", "place", "hand_over", "open_gripper", "close_gripper", "move_arm"),
        CapstoneState.MANIPULATING,
    ),
}


@dataclass(frozen=True, slots=True, kw_only=True)
class Activity:
    """Hold what the robot does, and how its newest plan stands; it starts out of reach."""

    capstone: CapstoneState = CapstoneState.STOPPED
    plan: PlanState = PlanState.IDLE


def activity_of(
    control: Document,
    executor: Document,
    planner: Document,
    speech: Document,
    *,
    has_succeeded: bool | None = None,
    ended_s: float = 0.0,
) -> Activity:
    """Return what the newest documents say; None is a process that is silent.

    `has_succeeded` is of the command that ended last, `ended_s` ago; None before any has.
    """
    state = str((control or {}).get("state") or "")
    executing = str((executor or {}).get("state") or "")
    has_asked = bool((planner or {}).get("question"))
    is_planning = bool((planner or {}).get("commands"))
    if state in _AT_REST:
        capstone = CapstoneState.STOPPED
    elif executing in _UNDER_WAY:
        skill = str((executor or {}).get("skill") or "")
        capstone = _BY_SKILL.get(skill, CapstoneState.PROCESSING)
    elif has_asked or (speech or {}).get("state") in ("hearing", "transcribing"):
        capstone = CapstoneState.LISTENING
    elif is_planning:
        capstone = CapstoneState.PROCESSING
    elif has_succeeded and ended_s < COMPLETED_S:
        capstone = CapstoneState.COMPLETED
    else:
        capstone = CapstoneState.IDLE
    if executing == "recovering":
        plan = PlanState.BLOCKED
    elif executing == "paused":
        plan = PlanState.PAUSED
    elif executing in _UNDER_WAY:
        plan = PlanState.EXECUTING if state == "armed" else PlanState.PAUSED
    elif has_asked:
        plan = PlanState.PAUSED
    elif is_planning:
        plan = PlanState.PLANNING
    elif has_succeeded is None:
        plan = PlanState.IDLE
    else:  # how the last one ended stays until the next
        plan = PlanState.COMPLETED if has_succeeded else PlanState.FAILED
    return Activity(capstone=capstone, plan=plan)
