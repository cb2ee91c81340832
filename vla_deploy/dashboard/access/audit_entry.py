"""Describe one act for the audit log: who, from where, what, with what outcome."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from datetime import UTC, datetime
from enum import StrEnum
from typing import Any, Final

_MOST_LETTERS: Final = 400
_MOST_DETAILS: Final = 12


class Outcome(StrEnum):
    """Say what became of an act."""

    DONE = "done"
    REFUSED = "refused"
    FAILED = "failed"


def outcome_of(status: int) -> Outcome:
    """Return what a status of HTTP means for whoever asked."""
    if status < 400:
        return Outcome.DONE
    return Outcome.REFUSED if status < 500 else Outcome.FAILED


@dataclass(frozen=True, slots=True, kw_only=True)
class AuditEntry:
    """Describe one act; `details` never hold a password, a token or a cookie."""

    user: str
    role: str
    way: str
    address: str
    act: str
    outcome: Outcome
    code: str = ""
    details: Mapping[str, Any] = field(default_factory=dict)

    @property
    def kind(self) -> tuple[str, ...]:
        """Return what entries share that are told once with their number."""
        return (self.user, self.address, self.act, self.outcome, self.code)

    def document(self, now_s: float, repeated: int = 0) -> dict[str, Any]:
        """Return what is written; `repeated` like it came since the last one that was."""
        told: dict[str, Any] = {
            "time": datetime.fromtimestamp(now_s, UTC).isoformat(timespec="milliseconds"),
            "user": self.user,
            "role": self.role,
            "way": self.way,
            "address": self.address,
            "act": self.act,
            "outcome": str(self.outcome),
        }
        optional = {"code": self.code, "details": _bounded(self.details), "repeated": repeated}
        return told | {name: value for name, value in optional.items() if value}


def _bounded(details: Mapping[str, Any]) -> dict[str, Any]:
    """Return details that fit on a line; numbers stay numbers, everything else becomes text."""
    kept = [one for one in details.items() if one[1] not in ("", None)][:_MOST_DETAILS]
    return {str(name)[:40]: _short(value) for name, value in kept}


def _short(value: Any) -> Any:
    return value if isinstance(value, bool | int | float) else str(value)[:_MOST_LETTERS]
