"""Describe a condition that somebody should know of: who, what, how much, and what to try."""

from dataclasses import dataclass
from enum import StrEnum


class Severity(StrEnum):
    """Order what a condition means for the robot, the gravest first."""

    CRITICAL = "critical"
    """Nobody knows what the robot does, or it cannot go on."""
    ERROR = "error"
    """It has stopped, or a part that its work needs is gone."""
    WARNING = "warning"
    """It goes on, with less than it should have."""
    INFO = "info"
    """It goes on; somebody may want to know why it does so differently."""


Key = tuple[str, str, str]
"""Process, field and subject: what tells one condition from another."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Finding:
    """Tell one condition as it is now.

    `field` names what was looked at: a topic, a counter, a cause. `measured` and `limit` are in
    `unit`, None where no number applies; `age_s` is how old the look's evidence is. `rise_s`
    replaces how long it must last to become an alarm.
    """

    process: str
    field: str
    text: str
    severity: Severity
    advice: str
    subject: str = ""
    measured: float | None = None
    limit: float | None = None
    unit: str = ""
    age_s: float | None = None
    rise_s: float | None = None

    @property
    def key(self) -> Key:
        """Return what stays the same while the numbers change."""
        return self.process, self.field, self.subject
