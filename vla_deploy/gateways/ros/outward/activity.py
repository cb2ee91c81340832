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


_AT_REST: Final = frozenset({"disarmed", "stopping", "stopped", "fault"})
_BY_SKILL: Final[Mapping[str, CapstoneState]] = {
    **dict.fromkeys(("navigate_to", "move", "turn", "find_object"), CapstoneState.NAVIGATING),
    **dict.fromkeys(
        ("pick_up", "place", "hand_over", "open_gripper", "close_gripper", "move_arm"),
        CapstoneState.MANIPULATING,
    ),
}


@dataclass(frozen=True, slots=True, kw_only=True)
class Activity:
    """Hold what the processes say; a silent control or executor counts as "".

    `has_succeeded` is of the command that ended last, `ended_s` ago; None before any has.
    """

    control: str = ""
    executor: str = ""
    skill: str = ""
    is_planning: bool = False
    has_asked: bool = False
    is_heard: bool = False
    has_succeeded: bool | None = None
    ended_s: float = 0.0

    @classmethod
    def of(
        cls,
        control: Document,
        executor: Document,
        planner: Document,
        speech: Document,
        *,
        has_succeeded: bool | None = None,
        ended_s: float = 0.0,
    ) -> "Activity":
        """Return what the newest documents say; None is a process that is silent."""
        control, executor = control or {}, executor or {}
        planner, speech = planner or {}, speech or {}
        return cls(
            control=str(control.get("state") or ""),
            executor=str(executor.get("state") or ""),
            skill=str(executor.get("skill") or ""),
            is_planning=bool(planner.get("commands")),
            has_asked=bool(planner.get("question")),
            is_heard=speech.get("state") in ("hearing", "transcribing"),
            has_succeeded=has_succeeded,
            ended_s=ended_s,
        )

    @property
    def is_executing(self) -> bool:
        """Return whether a plan is under way."""
        return self.executor in ("executing", "recovering")

    @property
    def capstone(self) -> CapstoneState:
        """Return the state of the whole robot."""
        if self.control in _AT_REST or not self.control:
            return CapstoneState.STOPPED
        if self.is_executing:
            return _BY_SKILL.get(self.skill, CapstoneState.PROCESSING)
        if self.has_asked or self.is_heard:
            return CapstoneState.LISTENING
        if self.is_planning:
            return CapstoneState.PROCESSING
        if self.has_succeeded and self.ended_s < COMPLETED_S:
            return CapstoneState.COMPLETED
        return CapstoneState.IDLE

    @property
    def plan(self) -> PlanState:
        """Return how the newest plan stands; how the last one ended stays until the next."""
        if self.executor == "recovering":
            return PlanState.BLOCKED
        if self.is_executing:
            at_rest = self.control != "armed"
            return PlanState.PAUSED if at_rest else PlanState.EXECUTING
        if self.has_asked:
            return PlanState.PAUSED
        if self.is_planning:
            return PlanState.PLANNING
        if self.has_succeeded is None:
            return PlanState.IDLE
        return PlanState.COMPLETED if self.has_succeeded else PlanState.FAILED
