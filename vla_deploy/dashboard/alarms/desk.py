"""Look for alarms twice a second, keep them, and let people say that they have seen them."""

from collections.abc import Callable
from typing import Any, Final

from drivers.clock import NS_PER_S, Clock
from vla_deploy.dashboard.alarms import ledger
from vla_deploy.dashboard.alarms.alarm import Alarm
from vla_deploy.dashboard.alarms.alarm_file import AlarmFile
from vla_deploy.dashboard.alarms.finding import Key
from vla_deploy.dashboard.alarms.judging import Condition, judge
from vla_deploy.dashboard.alarms.rules import find
from vla_deploy.dashboard.alarms.told import Told

_LOOK_NS: Final = NS_PER_S // 2


class AlarmDesk:
    """Hold the conditions of now and the ledger of alarms; `revision` changes with the ledger."""

    def __init__(
        self,
        run: str,
        listen: Callable[[], Told],
        file: AlarmFile,
        clock: Clock,
        wall_ns: Callable[[], int],
    ) -> None:
        self.revision = 0
        self._run = run
        self._listen = listen
        self._file = file
        self._clock = clock
        self._wall_ns = wall_ns
        self._due_ns = 0
        before, kept = file.read()
        # The alarms of this run go on where the dashboard, not the robot, was started anew.
        self._ledger = kept if before == run else ledger.ended(kept, self._now_s())
        self._conditions = _gone_on(self._ledger, clock.now_ns())

    def step(self) -> None:
        """Look, when it is time."""
        now_ns = self._clock.now_ns()
        if now_ns < self._due_ns:
            return
        self._due_ns = now_ns + _LOOK_NS
        self._conditions = judge(self._conditions, find(self._listen()), now_ns)
        raised = {key: one.finding for key, one in self._conditions.items() if one.raised}
        self._keep(ledger.take(self._ledger, raised, self._now_s()))

    def stop(self) -> None:
        """Keep what there is."""
        self._file.write(self._run, self._ledger)

    def acknowledge(self, alarm_id: str, by: str) -> Alarm | None:
        """Note who has seen an alarm, which goes on; None where there is no such alarm."""
        self._keep(ledger.acknowledge(self._ledger, alarm_id, by, self._now_s()))
        return self._ledger.find(alarm_id)

    def document(self) -> dict[str, Any]:
        """Return every alarm, the newest first."""
        return {"alarms": [alarm.document() for alarm in reversed(self._ledger.alarms)]}

    def _keep(self, after: ledger.Ledger) -> None:
        before, self._ledger = self._ledger, after
        if after != before:
            self.revision += 1
        if _lasting(after) != _lasting(before):
            self._file.write(self._run, after)

    def _now_s(self) -> float:
        return round(self._wall_ns() / NS_PER_S, 3)


def _gone_on(kept: ledger.Ledger, now_ns: int) -> dict[Key, Condition]:
    """Return the conditions of alarms that were open: they have the time to be found again."""
    return {
        alarm.key: Condition(finding=alarm.finding, since_ns=now_ns, seen_ns=now_ns, raised=True)
        for alarm in kept.alarms
        if alarm.is_open
    }


def _lasting(kept: ledger.Ledger) -> list[tuple[Any, ...]]:
    """Return what is worth a write: not the numbers, which change with every look."""
    return [
        (alarm.id, alarm.ended_s, alarm.acknowledged_by, alarm.severity, alarm.count)
        for alarm in kept.alarms
    ]
