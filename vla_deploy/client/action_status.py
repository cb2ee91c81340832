"""Name how an action of a plan stands, and count how the actions of a command ended."""

from collections.abc import Iterable
from enum import StrEnum
from typing import Final

from vla_deploy.ipc.payloads.tasks import CommandSummary, FinishedEvent


class ActionStatus(StrEnum):
    """Name how far an action has come; the last five are final."""

    PENDING = "pending"
    ACTIVE = "active"
    SUCCEEDED = "succeeded"
    CANCELLED = "cancelled"
    ABORTED = "aborted"
    REJECTED = "rejected"
    LOST = "lost"


UNFINISHED: Final = frozenset({ActionStatus.PENDING.value, ActionStatus.ACTIVE.value})
FINAL: Final = frozenset(one.value for one in ActionStatus) - UNFINISHED
FAILED: Final = frozenset({ActionStatus.ABORTED, ActionStatus.REJECTED, ActionStatus.LOST})


def summary_of(statuses: Iterable[str]) -> CommandSummary:
    """Return the counts of what was done, and the share of it that succeeded."""
    told = list(statuses)
    successful = told.count(ActionStatus.SUCCEEDED)
    return {
        "total_actions": len(told),
        "successful_actions": successful,
        "failed_actions": sum(one in FAILED for one in told),
        "success_rate": round(successful / len(told), 3) if told else 0.0,
    }


def end_without_actions(command_id: str, error: str = "") -> FinishedEvent:
    """Return the last event of a command for which no action was taken: done, or why not."""
    return {
        "command_id": command_id,
        "event": "finished",
        "success": not error,
        "error": error or None,
        "summary": summary_of(()),
        "actions": [],
    }
