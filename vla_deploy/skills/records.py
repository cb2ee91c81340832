"""Hold how actions went, and sum up a command."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from vla_deploy.client.action_status import FINAL, ActionStatus
from vla_deploy.ipc.payloads.tasks import ActionOutcome
from vla_deploy.plans.plan import Action, FailureCause


@dataclass(slots=True, kw_only=True)
class ActionRecord:
    """Hold how one action went."""

    action: Action
    status: ActionStatus = ActionStatus.PENDING
    execution_time_s: float = 0.0
    error: str = ""
    retries: int = 0
    note: str = ""
    data: Mapping[str, Any] = field(default_factory=dict)
    """What came of it: where the base stands, which hand holds what."""
    cause: FailureCause | None = None
    """By what it failed, where another plan may do better; None otherwise."""
    left: Mapping[str, float] | None = None
    """What is left of a relative motion that ended early; empty where nobody knows, else None."""

    @property
    def is_final(self) -> bool:
        """Return whether it has ended."""
        return self.status in FINAL

    @property
    def outcome(self) -> ActionOutcome:
        """Return the record as events and results have it."""
        return {
            "skill": self.action.skill,
            "parameters": self.action.parameters,
            "status": self.status.value,
            "execution_time_s": round(self.execution_time_s, 3),
            "error": self.error or None,
            "retries": self.retries,
            "note": self.note or None,
            "data": self.data,
        }


def has_succeeded(records: Sequence[ActionRecord], *, continue_on_error: bool) -> bool:
    """Return whether a plan succeeded: all of it, or with `continue_on_error` any of it."""
    counts = any if continue_on_error else all
    return counts(one.status is ActionStatus.SUCCEEDED for one in records)
