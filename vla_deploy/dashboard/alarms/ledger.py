"""Keep the alarms of now and of before, bounded: pure functions over an immutable ledger."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Final

from vla_deploy.dashboard.alarms.alarm import Alarm, raised
from vla_deploy.dashboard.alarms.finding import Finding, Key

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


def take(ledger: Ledger, findings: Mapping[Key, Finding], now_s: float) -> Ledger:
    """Return the ledger after the alarms that hold now: begun, gone on, come back or ended."""
    kept = [_go_on(alarm, findings.get(alarm.key), now_s) for alarm in ledger.alarms]
    lasting = {alarm.key for alarm in kept if alarm.is_open}
    number = ledger.next_number
    for key, finding in findings.items():
        if key in lasting:
            continue
        place = _come_back(kept, key, now_s)
        if place is None:
            kept.append(raised(number, finding, now_s))
            number += 1
        else:
            again = replace(kept[place], ended_s=None, count=kept[place].count + 1)
            kept[place] = again.with_numbers(finding)
    return Ledger(alarms=_bounded(kept), next_number=number)


def acknowledge(ledger: Ledger, alarm_id: str, by: str, now_s: float) -> Ledger:
    """Return the ledger after somebody has seen an alarm; the first who has is kept."""
    alarms = (
        replace(alarm, acknowledged_by=by, acknowledged_s=now_s)
        if alarm.id == alarm_id and not alarm.acknowledged_by
        else alarm
        for alarm in ledger.alarms
    )
    return replace(ledger, alarms=tuple(alarms))


def ended(ledger: Ledger, now_s: float) -> Ledger:
    """Return the ledger after the run: what was open has ended with it."""
    return replace(
        ledger,
        alarms=tuple(
            replace(alarm, ended_s=now_s) if alarm.is_open else alarm for alarm in ledger.alarms
        ),
    )


def _go_on(alarm: Alarm, finding: Finding | None, now_s: float) -> Alarm:
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
