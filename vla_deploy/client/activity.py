"""Judge from what the processes say of themselves what the robot does, in one word.

The judgement is a table: the first row that fits has the word, and the last one fits always. So
each combination of statuses has one activity, and what comes first in the table wins: a robot at
rest by safety is stopped, whatever else its processes say.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from enum import StrEnum
from typing import Any, Final

Document = Mapping[str, Any] | None

COMPLETED_S: Final = 3.0
"""How long a command that has ended well is shown before the robot is idle again."""


class RobotActivity(StrEnum):
    """Name what the robot does, from hearing a command to its end."""

    IDLE = "idle"
    LISTENING = "listening"
    PROCESSING = "processing"
    NAVIGATING = "navigating"
    MANIPULATING = "manipulating"
    COMPLETED = "completed"
    STOPPED = "stopped"


BY_SKILL: Final[Mapping[str, RobotActivity]] = {
    **dict.fromkeys(
        (
            "navigate_to",
            "charge",
            "follow_person",
            "guard",
            "inspect",
            "sweep",
            "move",
            "turn",
            "find_object",
        ),
        RobotActivity.NAVIGATING,
    ),
    **dict.fromkeys(
        ("pick_up", "place", "hand_over", "open_gripper", "close_gripper", "move_arm"),
        RobotActivity.MANIPULATING,
    ),
}
"""What a skill is; those that are not named, such as speaking, are processing."""
_AT_WORK: Final = frozenset({"executing", "recovering"})
_HEARING: Final = frozenset({"hearing", "transcribing"})


@dataclass(frozen=True, slots=True, kw_only=True)
class ProcessStatuses:
    """Hold the newest status of each process, None for a silent one, and how the last command went.

    `refusal` is why the supervisor lets no command be taken, "" where it does. `succeeded_s` is how
    long ago a command ended well, None where none has, or another has ended since.
    """

    control: Document = None
    executor: Document = None
    planner: Document = None
    speech: Document = None
    refusal: str = ""
    succeeded_s: float | None = None

    @property
    def stopped_by(self) -> str:
        """Return what keeps the robot from any work, "" where nothing does."""
        if self.control is None:
            return "control is silent"
        state = str(self.control.get("state") or "unknown")
        if state != "armed":
            return ": ".join(one for one in (state, str(self.control.get("cause") or "")) if one)
        if self.executor is None:
            return "the executor is silent"
        if self.refusal:
            return self.refusal
        return "the planner is silent" if self.planner is None and not self.is_at_work else ""

    @property
    def is_at_work(self) -> bool:
        """Return whether a plan is carried out, a paused one not."""
        return _state(self.executor) in _AT_WORK

    @property
    def skill_activity(self) -> RobotActivity | None:
        """Return what the skill that is carried out is, None where none is."""
        if not self.is_at_work:
            return None
        skill = str((self.executor or {}).get("skill") or "")
        return BY_SKILL.get(skill, RobotActivity.PROCESSING)

    @property
    def is_listening(self) -> bool:
        """Return whether it hears somebody speak, or waits for an answer."""
        return bool((self.planner or {}).get("question")) or _state(self.speech) in _HEARING

    @property
    def is_planning(self) -> bool:
        """Return whether commands are planned, or a plan waits to go on."""
        has_plan = _state(self.executor) not in ("", "idle")
        return bool((self.planner or {}).get("commands")) or has_plan

    @property
    def is_completed(self) -> bool:
        """Return whether a command has ended well just now."""
        return self.succeeded_s is not None and self.succeeded_s < COMPLETED_S


@dataclass(frozen=True, slots=True, kw_only=True)
class ActivityRule:
    """Hold a row of the table: the activity, and what it takes."""

    activity: RobotActivity
    holds: Callable[[ProcessStatuses], bool]


_Is = RobotActivity
ACTIVITY_RULES: Final[tuple[ActivityRule, ...]] = (
    ActivityRule(activity=_Is.STOPPED, holds=lambda now: bool(now.stopped_by)),
    ActivityRule(activity=_Is.NAVIGATING, holds=lambda now: now.skill_activity is _Is.NAVIGATING),
    ActivityRule(
        activity=_Is.MANIPULATING, holds=lambda now: now.skill_activity is _Is.MANIPULATING
    ),
    ActivityRule(activity=_Is.PROCESSING, holds=lambda now: now.skill_activity is not None),
    ActivityRule(activity=_Is.LISTENING, holds=lambda now: now.is_listening),
    ActivityRule(activity=_Is.PROCESSING, holds=lambda now: now.is_planning),
    ActivityRule(activity=_Is.COMPLETED, holds=lambda now: now.is_completed),
    ActivityRule(activity=_Is.IDLE, holds=lambda _now: True),
)
"""The one state machine of the robot: the first row that holds."""


def activity_of(now: ProcessStatuses) -> RobotActivity:
    """Return what the robot does."""
    return next(rule.activity for rule in ACTIVITY_RULES if rule.holds(now))


def _state(document: Document) -> str:
    return str((document or {}).get("state") or "")
