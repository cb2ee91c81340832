"""Tell which profile is in force, how far a change is, and how the last one ended."""

import logging
from typing import Any, Final

from drivers.clock import NS_PER_S, Clock
from vla_deploy.ipc import SharedSpace
from vla_deploy.supervisor.profiles.profile_change import (
    ChangeOutcome,
    ProfileChange,
    ProfileRequest,
)

_PERIOD_NS: Final = NS_PER_S // 2
_MOST_CHARACTERS: Final = 2000
_log = logging.getLogger(__name__)


class ProfileReport:
    """Write the `profile_status` cell, and the log's line about each request."""

    def __init__(self, space: SharedSpace, clock: Clock, begun_with: str) -> None:
        """Report for the whole run which profile it has `begun_with`: the way back to a file."""
        self._begun_with = begun_with
        self._cell = space.cell_writer("profile_status")
        self._clock = clock
        self._last: dict[str, Any] = {}
        self._due_ns = 0

    def conclude(
        self, request: ProfileRequest, outcome: ChangeOutcome, reason: str, took_s: float
    ) -> None:
        """Say how a request ended."""
        level = (
            logging.INFO
            if outcome in (ChangeOutcome.KEPT, ChangeOutcome.WOULD_WORK)
            else logging.WARNING
        )
        _log.log(level, "profile %s: %s%s", request.profile, outcome, reason and f" ({reason})")
        self._last = {
            "request_id": request.request_id,
            "profile": request.profile,
            "outcome": outcome.value,
            "reason": reason[:_MOST_CHARACTERS],
            "took_s": round(took_s, 3),
        }
        self._due_ns = 0

    def tell(self, profile: str, change: ProfileChange | None, fault: str) -> None:
        """Publish at a steady pace, and at once after an end.

        `fault` tells why the profile is not the chosen one; "" where it is.
        """
        now_ns = self._clock.now_ns()
        if now_ns < self._due_ns:
            return
        self._due_ns = now_ns + _PERIOD_NS
        self._cell.put_document(
            {
                "profile": profile,
                "begun_with": self._begun_with,
                "phase": change.phase.value if change else "",
                "target": change.request.profile if change else "",
                "last": self._last,
                "fault": fault,
            }
        )
