"""Describe conditions and alarms, and keep a bounded ledger of alarms by pure functions."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass, fields, replace
from enum import StrEnum
from typing import Any, Final


class AlarmSeverity(StrEnum):
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
class AlarmFinding:
    """Tell one condition as it is now.

    `field` names what was looked at: a topic, a counter, a cause. `measured` and `limit` are in
    `unit`, None where no number applies; `age_s` is how old the look's evidence is. `rise_s`
    replaces how long it must last to become an alarm.
    """

    process: str
    field: str
    text: str
    severity: AlarmSeverity
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


_TOLD: Final = tuple(one.name for one in fields(AlarmFinding) if one.name != "rise_s")
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
    severity: AlarmSeverity
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

    def with_numbers(self, finding: AlarmFinding) -> "Alarm":
        """Return it with what its condition is now."""
        return replace(self, **_of(finding))

    @property
    def finding(self) -> AlarmFinding:
        """Return the condition as it was told last."""
        told = {name: getattr(self, name) for name in _TOLD}
        return AlarmFinding(**told)

    def document(self) -> dict[str, Any]:
        """Return it as JSON."""
        return asdict(self)


def new_alarm(number: int, finding: AlarmFinding, since_s: float) -> Alarm:
    """Return a new alarm."""
    return Alarm(id=str(number), since_s=since_s, **_of(finding))


def alarm_from_document(document: dict[str, Any]) -> Alarm:
    """Return an alarm that was kept.

    Raises:
        ValueError: it is none.
    """
    try:
        return Alarm(**{**document, "severity": AlarmSeverity(document["severity"])})
    except (KeyError, TypeError) as error:
        raise ValueError(f"{document!r:.80} is no alarm: {error}") from error


def _of(finding: AlarmFinding) -> dict[str, Any]:
    told = {name: getattr(finding, name) for name in _TOLD}
    return told | {name: _rounded(told[name]) for name in ("measured", "limit", "age_s")}


def _rounded(value: float | None) -> float | None:
    return None if value is None else round(value, _DIGITS)


MOST_ALARMS: Final = 200
BACK_SOON_S: Final = 60.0
"""An alarm that comes back within that time is the same one, and stays seen."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Ledger:
    """Hold the alarms in the order they were raised, and the number of the next."""

    alarms: tuple[Alarm, ...] = ()
    next_number: int = 1

    def find(self, alarm_id: str) -> Alarm | None:
        """Return an alarm by its id."""
        return next((alarm for alarm in self.alarms if alarm.id == alarm_id), None)


def update_ledger(ledger: Ledger, findings: Mapping[Key, AlarmFinding], now_s: float) -> Ledger:
    """Return the ledger after the alarms that hold now: begun, gone on, come back or ended."""
    kept = [_go_on(alarm, findings.get(alarm.key), now_s) for alarm in ledger.alarms]
    lasting = {alarm.key for alarm in kept if alarm.is_open}
    number = ledger.next_number
    for key, finding in findings.items():
        if key in lasting:
            continue
        place = _come_back(kept, key, now_s)
        if place is None:
            kept.append(new_alarm(number, finding, now_s))
            number += 1
        else:
            again = replace(kept[place], ended_s=None, count=kept[place].count + 1)
            kept[place] = again.with_numbers(finding)
    return Ledger(alarms=_bounded(kept), next_number=number)


def acknowledge_alarm(ledger: Ledger, alarm_id: str, by: str, now_s: float) -> Ledger:
    """Return the ledger after somebody has seen an alarm; the first who has is kept."""
    alarms = (
        replace(alarm, acknowledged_by=by, acknowledged_s=now_s)
        if alarm.id == alarm_id and not alarm.acknowledged_by
        else alarm
        for alarm in ledger.alarms
    )
    return replace(ledger, alarms=tuple(alarms))


def end_all(ledger: Ledger, now_s: float) -> Ledger:
    """Return the ledger after the run: what was open has ended with it."""
    return replace(
        ledger,
        alarms=tuple(
            replace(alarm, ended_s=now_s) if alarm.is_open else alarm for alarm in ledger.alarms
        ),
    )


def _go_on(alarm: Alarm, finding: AlarmFinding | None, now_s: float) -> Alarm:
    if not alarm.is_open:
        return alarm
    return replace(alarm, ended_s=now_s) if finding is None else alarm.with_numbers(finding)


def _come_back(alarms: list[Alarm], key: Key, now_s: float) -> int | None:
    for place, alarm in enumerate(alarms):
        if alarm.key == key and alarm.ended_s is not None and now_s - alarm.ended_s < BACK_SOON_S:
            return place
    return None


def _bounded(alarms: list[Alarm]) -> tuple[Alarm, ...]:
    """Leave out the oldest that have ended, then the oldest of all."""
    excess = len(alarms) - MOST_ALARMS
    if excess <= 0:
        return tuple(alarms)
    over = [alarm.id for alarm in alarms if not alarm.is_open]
    gone = {*over[:excess]}
    left = [alarm for alarm in alarms if alarm.id not in gone]
    return tuple(left[-MOST_ALARMS:])
