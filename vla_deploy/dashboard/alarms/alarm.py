"""Hold one alarm as people see it, from its raising to long after its end."""

from dataclasses import asdict, dataclass, fields, replace
from typing import Any, Final

from vla_deploy.dashboard.alarms.finding import Finding, Key, Severity

_TOLD: Final = tuple(one.name for one in fields(Finding) if one.name != "rise_s")
_DIGITS: Final = 3


@dataclass(frozen=True, slots=True, kw_only=True)
class Alarm:
    """Tell what a finding told, since when (Unix seconds), and who has seen it.

    `ended_s` and `acknowledged_s` are None while it lasts and until somebody has seen it; being
    seen does not end it. `count` is how often it came back soon after it had gone.
    """

    id: str
    process: str
    field: str
    subject: str
    text: str
    severity: Severity
    advice: str
    measured: float | None
    limit: float | None
    unit: str
    age_s: float | None
    since_s: float
    ended_s: float | None = None
    acknowledged_by: str | None = None
    acknowledged_s: float | None = None
    count: int = 1

    @property
    def key(self) -> Key:
        """Return what stays the same while the numbers change."""
        return self.process, self.field, self.subject

    @property
    def is_open(self) -> bool:
        """Tell whether its condition lasts."""
        return self.ended_s is None

    def with_numbers(self, finding: Finding) -> "Alarm":
        """Return it with what its condition is now."""
        return replace(self, **_of(finding))

    @property
    def finding(self) -> Finding:
        """Return the condition as it was told last."""
        told = {name: getattr(self, name) for name in _TOLD}
        return Finding(**told)

    def document(self) -> dict[str, Any]:
        """Return it as JSON."""
        return asdict(self)


def raised(number: int, finding: Finding, since_s: float) -> Alarm:
    """Return a new alarm."""
    return Alarm(id=str(number), since_s=since_s, **_of(finding))


def alarm_of(document: dict[str, Any]) -> Alarm:
    """Return an alarm that was kept.

    Raises:
        ValueError: it is none.
    """
    try:
        return Alarm(**{**document, "severity": Severity(document["severity"])})
    except (KeyError, TypeError) as error:
        raise ValueError(f"{document!r:.80} is no alarm: {error}") from error


def _of(finding: Finding) -> dict[str, Any]:
    told = {name: getattr(finding, name) for name in _TOLD}
    return told | {name: _rounded(told[name]) for name in ("measured", "limit", "age_s")}


def _rounded(value: float | None) -> float | None:
    return None if value is None else round(value, _DIGITS)
