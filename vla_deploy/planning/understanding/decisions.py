"""Log how each expression of a command was understood: candidates, choice, and why."""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

from vla_deploy.planning.understanding.conversation import Role


@dataclass(frozen=True, slots=True, kw_only=True)
class Decision:
    """Hold one decision: what was `asked`, among which `candidates`, what was `chosen` and `why`.

    `certainty`, 0 to 1, is how surely the words mean it.
    """

    asked: str
    role: Role
    candidates: tuple[str, ...] = ()
    chosen: str
    why: str
    certainty: float = 1.0

    def document(self) -> dict[str, Any]:
        """Return it as events tell it."""
        return {
            "asked": self.asked,
            "role": self.role.value,
            "candidates": list(self.candidates),
            "chosen": self.chosen,
            "why": self.why,
            "certainty": round(self.certainty, 2),
        }

    def __str__(self) -> str:
        return f'"{self.asked}" is {self.chosen} ({self.why})'


def reasoning(decisions: Iterable[Decision]) -> str:
    """Return the log as one sentence for the plan's reasoning."""
    return "; ".join(dict.fromkeys(str(one) for one in decisions))
