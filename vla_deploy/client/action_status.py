"""Name how an action of a plan stands."""

from enum import StrEnum
from typing import Final


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
