"""Describe findings and alarms, and keep a bounded ledger of alarms by pure functions."""

from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from enum import StrEnum
from typing import Any, Final

Key = tuple[str, str, str]
"""Process, field and subject, which identify a finding."""
_NUMBERS: Final = ("measured", "limit", "age_s")
_DIGITS: Final = 3
MOST_ALARMS: Final = 200
BACK_SOON_S: Final = 60.0
"""An alarm that comes back within this time is the same one, and stays acknowledged."""


class AlarmSeverity(StrEnum):
    """Order what a finding means for the robot, the most severe first."""

    CRITICAL = "critical"
    """The robot's state is unknown, or it cannot go on."""
    ERROR = "error"
    """It has stopped, or lost a part that its work needs."""
    WARNING = "warning"
    """It works with less than it should have."""
    INFO = "info"
    """It works, but in another way than usual."""


@dataclass(frozen=True, slots=True, kw_only=True)
class AlarmFinding:
    """Describe one condition as it is now.

    `field` names what was examined: a topic, a counter, a cause. `measured` and `limit` are in
    `unit`, None where no number applies; `age_s` is the age of the evidence. `rise_s` replaces the
    default time that it must last to become an alarm.
    """

    process: str
    field: str
    subject: str = ""
    text: str
    severity: AlarmSeverity
    advice: str
    measured: float | None = None
    limit: float | None = None
    unit: str = ""
    age_s: float | None = None
    rise_s: float | None = None

    @property
    def key(self) -> Key:
        """Return what identifies the finding while its numbers change."""
        return self.process, self.field, self.subject


_PUBLISHED: Final = tuple(one.name for one in fields(AlarmFinding) if one.name != "rise_s")


@dataclass(frozen=True, slots=True, kw_only=True)
class Alarm:
    """Hold a finding that became an alarm; times are Unix seconds.

    `ended_s` is None while the condition lasts, `acknowledged_s` until a user acknowledges the
    alarm, which does not end it. `count` is how often it came back soon after it had ended.
    """

    id: str
    finding: AlarmFinding
    since_s: float
    ended_s: float | None = None
    acknowledged_by: str | None = None
    acknowledged_s: float | None = None
    count: int = 1

    @property
    def is_open(self) -> bool:
        """Return whether its condition lasts."""
        return self.ended_s is None

    def document(self) -> dict[str, Any]:
        """Return it as JSON."""
        return {
            "id": self.id,
            **{name: getattr(self.finding, name) for name in _PUBLISHED},
            **{name: getattr(self, name) for name in _OF_ALARM},
        }


_OF_ALARM: Final = tuple(one.name for one in fields(Alarm) if one.name not in ("id", "finding"))


def alarm_from_document(document: dict[str, Any]) -> Alarm:
    """Return an alarm that was stored.

    Raises:
        ValueError: the document is no alarm.
    """
    try:
        finding = {name: document[name] for name in _PUBLISHED}
        finding["severity"] = AlarmSeverity(document["severity"])
        state = {name: document[name] for name in _OF_ALARM}
        return Alarm(id=document["id"], finding=AlarmFinding(**finding), **state)
    except (KeyError, TypeError) as error:
        raise ValueError(f"{document!r:.80} is no alarm: {error}") from error


@dataclass(frozen=True, slots=True, kw_only=True)
class Ledger:
    """Hold the alarms in the order they were raised, and the number of the next."""

    alarms: tuple[Alarm, ...] = ()
    next_number: int = 1

    def find(self, alarm_id: str) -> Alarm | None:
        """Return an alarm by its id."""
        return next((alarm for alarm in self.alarms if alarm.id == alarm_id), None)


def update_ledger(ledger: Ledger, findings: Mapping[Key, AlarmFinding], now_s: float) -> Ledger:
    """Return the ledger with the alarms of these findings; all others have ended."""
    kept = [_updated(alarm, findings.get(alarm.finding.key), now_s) for alarm in ledger.alarms]
    open_keys = {alarm.finding.key for alarm in kept if alarm.is_open}
    number = ledger.next_number
    for key, finding in findings.items():
        if key in open_keys:
            continue
        place = _recently_ended(kept, key, now_s)
        if place is None:
            kept.append(Alarm(id=str(number), finding=_rounded(finding), since_s=now_s))
            number += 1
        else:
            count = kept[place].count + 1
            kept[place] = replace(kept[place], finding=_rounded(finding), ended_s=None, count=count)
    return Ledger(alarms=_bounded(kept), next_number=number)


def acknowledge_alarm(ledger: Ledger, alarm_id: str, by: str, now_s: float) -> Ledger:
    """Return the ledger with an alarm acknowledged; the first user who did so is kept."""
    alarms = (
        replace(alarm, acknowledged_by=by, acknowledged_s=now_s)
        if alarm.id == alarm_id and not alarm.acknowledged_by
        else alarm
        for alarm in ledger.alarms
    )
    return replace(ledger, alarms=tuple(alarms))


def end_all(ledger: Ledger, now_s: float) -> Ledger:
    """Return the ledger after the end of the run, which ends all open alarms."""
    return replace(ledger, alarms=tuple(_updated(alarm, None, now_s) for alarm in ledger.alarms))


def _updated(alarm: Alarm, finding: AlarmFinding | None, now_s: float) -> Alarm:
    if not alarm.is_open:
        return alarm
    if finding is None:
        return replace(alarm, ended_s=now_s)
    return replace(alarm, finding=_rounded(finding))


def _rounded(finding: AlarmFinding) -> AlarmFinding:
    """Return a finding with rounded numbers; how long it must last matters no more."""
    values: dict[str, Any] = {name: getattr(finding, name) for name in _NUMBERS}
    rounded = {name: value and round(value, _DIGITS) for name, value in values.items()}
    return replace(finding, rise_s=None, **rounded)


def _recently_ended(alarms: list[Alarm], key: Key, now_s: float) -> int | None:
    for place, alarm in enumerate(alarms):
        is_recent = alarm.ended_s is not None and now_s - alarm.ended_s < BACK_SOON_S
        if alarm.finding.key == key and is_recent:
            return place
    return None


def _bounded(alarms: list[Alarm]) -> tuple[Alarm, ...]:
    """Drop the oldest ended alarms, then the oldest of all."""
    excess = len(alarms) - MOST_ALARMS
    if excess <= 0:
        return tuple(alarms)
    dropped = [alarm.id for alarm in alarms if not alarm.is_open][:excess]
    return tuple([alarm for alarm in alarms if alarm.id not in dropped][-MOST_ALARMS:])
