"""Hold what was said lately between a person and the robot."""

from dataclasses import dataclass
from typing import Final

from vla_deploy.planning.plan import Plan

MOST_TURNS: Final = 5


@dataclass(frozen=True, slots=True, kw_only=True)
class Turn:
    """Hold one command, what the robot answered to it, and the plan that came of it or None."""

    said: str
    answer: str = ""
    plan: Plan | None = None


@dataclass(frozen=True, slots=True)
class Conversation:
    """Hold the latest turns, the newest last."""

    turns: tuple[Turn, ...] = ()

    def after(self, turn: Turn) -> "Conversation":
        """Return the conversation with one more turn; the oldest are forgotten."""
        return Conversation((*self.turns, turn)[-MOST_TURNS:])
