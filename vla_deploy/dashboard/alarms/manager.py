"""Raise, clear and store alarms, and publish them as a live topic."""

import json
import logging
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from drivers.clock import NS_PER_S, Clock
from vla_deploy.dashboard.alarms.alarm import (
    Alarm,
    AlarmFinding,
    AlarmSeverity,
    Key,
    Ledger,
    acknowledge_alarm,
    alarm_from_document,
    end_all,
    update_ledger,
)
from vla_deploy.dashboard.alarms.robot_status import RobotStatus
from vla_deploy.dashboard.alarms.rules import find
from vla_deploy.dashboard.live.message import LiveMessage, LookTime, json_message

_LOOK_NS: Final = NS_PER_S // 2
_FILE_MODE: Final = 0o600
_log = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True)
class RaiseDelay:
    """Set how long a finding must last to raise an alarm, and be absent to clear it."""

    rise_s: float
    fall_s: float


RAISE_DELAYS: Final[Mapping[AlarmSeverity, RaiseDelay]] = {
    AlarmSeverity.CRITICAL: RaiseDelay(rise_s=0.5, fall_s=2.0),
    AlarmSeverity.ERROR: RaiseDelay(rise_s=1.0, fall_s=3.0),
    AlarmSeverity.WARNING: RaiseDelay(rise_s=3.0, fall_s=5.0),
    AlarmSeverity.INFO: RaiseDelay(rise_s=5.0, fall_s=10.0),
}


@dataclass(frozen=True, slots=True, kw_only=True)
class TrackedFinding:
    """Track one finding: its newest form, since when, when last found, whether raised."""

    finding: AlarmFinding
    since_ns: int
    seen_ns: int
    raised: bool = False


def judge(
    before: Mapping[Key, TrackedFinding], findings: Mapping[Key, AlarmFinding], now_ns: int
) -> dict[Key, TrackedFinding]:
    """Return the tracked findings after a look; the raised ones are alarms."""
    after = {key: _seen(before.get(key), finding, now_ns) for key, finding in findings.items()}
    lasting = {
        key: condition
        for key, condition in before.items()
        if key not in findings and condition.raised and not _is_over(condition, now_ns)
    }
    return lasting | after


def _seen(before: TrackedFinding | None, finding: AlarmFinding, now_ns: int) -> TrackedFinding:
    since_ns = now_ns if before is None else before.since_ns
    rise_s = RAISE_DELAYS[finding.severity].rise_s if finding.rise_s is None else finding.rise_s
    raised = before is not None and before.raised
    return TrackedFinding(
        finding=finding,
        since_ns=since_ns,
        seen_ns=now_ns,
        raised=raised or now_ns - since_ns >= rise_s * NS_PER_S,
    )


def _is_over(condition: TrackedFinding, now_ns: int) -> bool:
    fall_s = RAISE_DELAYS[condition.finding.severity].fall_s
    return now_ns - condition.seen_ns >= fall_s * NS_PER_S


class AlarmFile:
    """Store one ledger with the name of its run, so that it outlives the dashboard."""

    def __init__(self, path: Path) -> None:
        self.refused = 0
        """How many writes the disk has refused."""
        self._path = path

    def read(self) -> tuple[str, Ledger]:
        """Return the run and its ledger; an empty one where the file cannot be read."""
        try:
            document = json.loads(self._path.read_text(encoding="utf-8"))
            alarms = tuple(alarm_from_document(one) for one in document["alarms"])
            return str(document["run"]), Ledger(alarms=alarms, next_number=int(document["next"]))
        except FileNotFoundError:
            return "", Ledger()
        except (OSError, ValueError, TypeError, KeyError) as error:
            _log.warning("%s: the alarms of before are lost: %s", self._path, error)
            return "", Ledger()

    def write(self, run: str, ledger: Ledger) -> None:
        """Replace the file; failures are counted, and logged once."""
        alarms = [alarm.document() for alarm in ledger.alarms]
        text = json.dumps({"run": run, "next": ledger.next_number, "alarms": alarms})
        fresh = self._path.with_suffix(".new")
        try:
            self._path.parent.mkdir(parents=True, exist_ok=True)
            fresh.write_text(text, encoding="utf-8")
            fresh.chmod(_FILE_MODE)
            fresh.replace(self._path)
        except OSError as error:
            if not self.refused:
                _log.warning("%s: alarms will not outlive the dashboard: %s", self._path, error)
            self.refused += 1


class AlarmManager:
    """Hold the tracked findings and the ledger of alarms; `revision` changes with the ledger."""

    def __init__(
        self,
        run: str,
        read_status: Callable[[], RobotStatus],
        file: AlarmFile,
        clock: Clock,
        wall_ns: Callable[[], int],
    ) -> None:
        self.revision = 0
        self._run = run
        self._read_status = read_status
        self._file = file
        self._clock = clock
        self._wall_ns = wall_ns
        self._due_ns = 0
        before, kept = file.read()
        # After a restart of the dashboard alone the alarms of the run stay open.
        self._ledger = kept if before == run else end_all(kept, self._now_s())
        self._conditions = _tracked(self._ledger, clock.now_ns())

    def step(self) -> None:
        """Read the status and update the alarms twice a second."""
        now_ns = self._clock.now_ns()
        if now_ns < self._due_ns:
            return
        self._due_ns = now_ns + _LOOK_NS
        self._conditions = judge(self._conditions, find(self._read_status()), now_ns)
        raised = {key: one.finding for key, one in self._conditions.items() if one.raised}
        self._keep(update_ledger(self._ledger, raised, self._now_s()))

    def stop(self) -> None:
        """Store the ledger."""
        self._file.write(self._run, self._ledger)

    def acknowledge(self, alarm_id: str, by: str) -> Alarm | None:
        """Record who acknowledges an alarm, which stays open; return None without such an alarm."""
        self._keep(acknowledge_alarm(self._ledger, alarm_id, by, self._now_s()))
        return self._ledger.find(alarm_id)

    def document(self) -> dict[str, Any]:
        """Return every alarm, the newest first."""
        return {"alarms": [alarm.document() for alarm in reversed(self._ledger.alarms)]}

    def _keep(self, after: Ledger) -> None:
        before, self._ledger = self._ledger, after
        if after != before:
            self.revision += 1
        if _stored_part(after) != _stored_part(before):
            self._file.write(self._run, after)

    def _now_s(self) -> float:
        return round(self._wall_ns() / NS_PER_S, 3)


def _tracked(kept: Ledger, now_ns: int) -> dict[Key, TrackedFinding]:
    """Return open alarms as tracked findings, so that they have time to be found again."""
    return {
        alarm.finding.key: TrackedFinding(
            finding=alarm.finding, since_ns=now_ns, seen_ns=now_ns, raised=True
        )
        for alarm in kept.alarms
        if alarm.is_open
    }


def _stored_part(kept: Ledger) -> list[tuple[Any, ...]]:
    """Return what is worth a write, without numbers, which change with every look."""
    return [
        (
            alarm.id,
            alarm.ended_s,
            alarm.acknowledged_by,
            alarm.finding.severity,
            alarm.count,
        )
        for alarm in kept.alarms
    ]


class AlarmFeed:
    """Publish the live topic "alarms"."""

    topic = "alarms"
    period_s = 0.5

    def __init__(self, manager: AlarmManager) -> None:
        self._manager = manager
        self._sent = -1

    def begin(self) -> None:
        """Send the alarms again."""
        self._sent = -1

    def look(self, now: LookTime) -> Sequence[LiveMessage]:
        """Return the alarms, if any has changed."""
        if self._manager.revision == self._sent:
            return ()
        self._sent = self._manager.revision
        return (json_message(self.topic, now.run_ns, now, self._manager.document()),)
