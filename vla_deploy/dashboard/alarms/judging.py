"""Turn conditions into alarms: raised when they last, cleared when they are gone for a while."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

from drivers.clock import NS_PER_S
from vla_deploy.dashboard.alarms.finding import Finding, Key, Severity


@dataclass(frozen=True, slots=True)
class Patience:
    """Declare how long a condition must last, and be gone, before that counts."""

    rise_s: float
    fall_s: float


PATIENCE: Final[Mapping[Severity, Patience]] = {
    Severity.CRITICAL: Patience(rise_s=0.5, fall_s=2.0),
    Severity.ERROR: Patience(rise_s=1.0, fall_s=3.0),
    Severity.WARNING: Patience(rise_s=3.0, fall_s=5.0),
    Severity.INFO: Patience(rise_s=5.0, fall_s=10.0),
}


@dataclass(frozen=True, slots=True, kw_only=True)
class Condition:
    """Follow one finding: its newest form, since when, when it was last seen, whether raised."""

    finding: Finding
    since_ns: int
    seen_ns: int
    raised: bool = False


def judge(
    before: Mapping[Key, Condition], findings: Mapping[Key, Finding], now_ns: int
) -> dict[Key, Condition]:
    """Return the conditions after a look; the raised ones are alarms."""
    after = {key: _seen(before.get(key), finding, now_ns) for key, finding in findings.items()}
    lasting = {
        key: condition
        for key, condition in before.items()
        if key not in findings and condition.raised and not _is_over(condition, now_ns)
    }
    return lasting | after


def _seen(before: Condition | None, finding: Finding, now_ns: int) -> Condition:
    since_ns = now_ns if before is None else before.since_ns
    rise_s = PATIENCE[finding.severity].rise_s if finding.rise_s is None else finding.rise_s
    raised = before is not None and before.raised
    return Condition(
        finding=finding,
        since_ns=since_ns,
        seen_ns=now_ns,
        raised=raised or now_ns - since_ns >= rise_s * NS_PER_S,
    )


def _is_over(condition: Condition, now_ns: int) -> bool:
    fall_s = PATIENCE[condition.finding.severity].fall_s
    return now_ns - condition.seen_ns >= fall_s * NS_PER_S
