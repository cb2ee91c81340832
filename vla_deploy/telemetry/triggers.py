"""Decide what triggers the writing of a flight, and when: pure, on documents and stamps."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import Enum
from typing import Any, Final

from drivers.clock import NS_PER_S

_IN_SERVICE = frozenset({"disarmed", "arming", "armed", "disarming"})
_TROUBLE = frozenset({"back-off", "given up"})
_MAX_CAUSES = 50
_SELF = "recorder"


class TriggerKind(Enum):
    """Name the kinds of triggers."""

    STOP = "stop"
    CRASH = "crash"
    REQUEST = "request"


# Kept in memory: 30 s before a trigger, a few after it, and the time until they are written.
KEPT_NS: Final = 36 * NS_PER_S
# How long after its trigger a flight goes on.
AFTER_S: Mapping[TriggerKind, float] = {
    TriggerKind.STOP: 3.0,
    TriggerKind.CRASH: 3.0,
    TriggerKind.REQUEST: 0.0,
}


@dataclass(frozen=True, slots=True, kw_only=True)
class FlightTrigger:
    """Describe what happened, and when."""

    kind: TriggerKind
    what: str
    at_ns: int
    detail: str = ""


@dataclass(slots=True)
class TriggerDetector:
    """Compare control's status and the process table with those before."""

    _stopped_by: str | None = None
    _rows: dict[str, tuple[str, int]] = field(default_factory=dict)
    _has_status: bool = False

    def status(self, document: Mapping[str, Any], at_ns: int) -> list[FlightTrigger]:
        """Return a trigger when the robot stops, or when the cause of its stop changes."""
        state, cause = str(document["state"]), str(document["cause"])
        stopped_by = None if state in _IN_SERVICE or not cause else cause  # a disarm has no cause
        before, self._stopped_by = self._stopped_by, stopped_by
        known, self._has_status = self._has_status, True
        if not known or stopped_by is None or stopped_by == before:
            return []
        detail = str(document.get("detail", ""))
        return [FlightTrigger(kind=TriggerKind.STOP, what=stopped_by, at_ns=at_ns, detail=detail)]

    def table(self, document: Mapping[str, Any], at_ns: int) -> list[FlightTrigger]:
        """Return a trigger for each process that has crashed, the recorder included."""
        triggers = []
        for row in document["processes"]:
            state, restarts = str(row["state"]), int(row["restarts"])
            before = self._rows.get(row["name"])
            self._rows[row["name"]] = (state, restarts)
            if before is None and row["name"] == _SELF:
                before = ("", 0)  # the flight that it was about to write is lost: write it now
            if before is None or before[0] in _TROUBLE:
                continue
            if state in _TROUBLE or restarts > before[1]:
                detail = str(row["reason"] or f"exit code {row['exit_code']}")
                triggers.append(
                    FlightTrigger(
                        kind=TriggerKind.CRASH, what=str(row["name"]), at_ns=at_ns, detail=detail
                    )
                )
        return triggers


@dataclass(slots=True)
class Debounce:
    """Put triggers that come close together into one flight.

    The next flight waits until `gap_s` after the last one, which loses nothing while that is less
    than the time kept in memory; a request does not wait.
    """

    gap_s: float = 20.0
    longest_s: float = 10.0
    _waiting: list[FlightTrigger] = field(default_factory=list)
    _due_ns: float = math.inf
    _written_ns: float = -math.inf

    def add(self, trigger: FlightTrigger) -> None:
        """Add one trigger."""
        wanted_ns = trigger.at_ns + AFTER_S[trigger.kind] * NS_PER_S
        if trigger.kind is TriggerKind.REQUEST:
            self._due_ns = wanted_ns
        elif not self._waiting:
            self._due_ns = max(wanted_ns, self._written_ns + self.gap_s * NS_PER_S)
        else:
            latest_ns = self._waiting[0].at_ns + self.longest_s * NS_PER_S
            self._due_ns = max(self._due_ns, min(wanted_ns, latest_ns))
        if len(self._waiting) < _MAX_CAUSES:
            self._waiting.append(trigger)

    def take(self, now_ns: float) -> list[FlightTrigger]:
        """Return, once, the triggers of the flight that is due; with `inf`, all that wait."""
        if not self._waiting or now_ns < self._due_ns:
            return []
        due, self._waiting = self._waiting, []
        self._due_ns, self._written_ns = math.inf, now_ns
        return due
