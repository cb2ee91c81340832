"""Remember the commands of every source and what became of them, for those who come later."""

import logging
from collections import OrderedDict
from collections.abc import Callable
from typing import Any, Final

from drivers.clock import NS_PER_S
from vla_deploy.client.action_status import end_without_actions
from vla_deploy.client.command_record import (
    CommandRecord,
    Kind,
    is_of_planner,
    part_of,
    record_of,
)
from vla_deploy.client.following import ANSWER_TIMEOUT_S, LAST_EVENTS, Following
from vla_deploy.client.link import RobotLink
from vla_deploy.ipc import Event, topics
from vla_deploy.ipc.payloads.tasks import TaskEvent, Utterance

MOST_COMMANDS: Final = 200
_JUDGE_PERIOD_NS: Final = NS_PER_S // 2
_UNKNOWN: Final = "unknown"
_UNANSWERED: Final = (
    f"lost: no answer from planner or executor within {ANSWER_TIMEOUT_S:g} s, the command is not "
    "carried out; see the state of both, and stop the robot if it moves"
)
_log = logging.getLogger(__name__)

Follow = Callable[[CommandRecord, dict[str, Any]], None]
"""Take a command's newest event, which the record holds already, with its moment `at_s`."""


class CommandHistory:
    """Read the rings of commands and their events; what is still in them at the start counts.

    A command that nobody works on any more ends here as `lost`: no command stays open for ever.
    """

    def __init__(
        self, link: RobotLink, wall_ns: Callable[[], int], follow: Follow | None = None
    ) -> None:
        """Take what the rings hold; `follow` gets the events that come from now on."""
        self._link = link
        self._wall_ns = wall_ns
        self._utterances = link.events(topics.UTTERANCE, from_start=True)
        self._events = link.events(topics.TASK_EVENT, from_start=True)
        self._records: OrderedDict[str, CommandRecord] = OrderedDict()
        self._open: dict[str, Following] = {}
        self._lost = 0
        self._judge_due_ns = 0
        self._follow: Follow | None = None
        self.step()
        self._follow = follow

    def step(self) -> None:
        """Take what is new, and look now and then for commands that nobody works on."""
        now_ns = self._link.clock.now_ns()
        is_due = now_ns >= self._judge_due_ns
        reasons = self._reasons() if is_due else {}
        for said in self._utterances.drain():
            self._hear(said)
        for event in self._events.drain():
            self._note(event)
        self._note_lost()
        if is_due:
            self._judge_due_ns = now_ns + _JUDGE_PERIOD_NS
            self._end_lost(reasons)

    def stop(self) -> None:
        """Forget the rings."""
        self._utterances.close()
        self._events.close()

    def find(self, command_id: str) -> CommandRecord | None:
        """Return a command; None when it was never given, or is long forgotten."""
        self.step()
        return self._records.get(command_id)

    def newest(self, limit: int) -> list[CommandRecord]:
        """Return the newest commands, the newest first."""
        self.step()
        return list(reversed(self._records.values()))[:limit]

    def _hear(self, event: Event[Utterance]) -> None:
        record = record_of(event.payload, self._wall_s(event.stamp_ns))
        self._keep(record)
        if record.kind in (Kind.COMMAND, Kind.ANSWER):
            self._open[record.command_id] = self._following(record.command_id)

    def _following(self, command_id: str) -> Following:
        link = self._link
        return Following(
            command_id,
            planner=lambda: link.fresh(topics.PLANNER_STATUS, age_limit_s=2.0),
            executor=lambda: link.fresh(topics.EXECUTOR_STATUS, age_limit_s=1.0),
            clock=link.clock,
        )

    def _keep(self, record: CommandRecord) -> None:
        self._records[record.command_id] = record
        while len(self._records) > MOST_COMMANDS:
            forgotten, _ = self._records.popitem(last=False)
            self._open.pop(forgotten, None)

    def _note(self, event: Event[TaskEvent]) -> None:
        told, at_s = event.payload, self._wall_s(event.stamp_ns)
        command_id = told["command_id"]
        if is_of_planner(command_id):
            return
        if command_id not in self._records:
            self._keep(self._unheard(command_id, at_s))
        has_ended = self._records[command_id].standing.is_final
        if has_ended and told["event"] in LAST_EVENTS:
            return  # who was asked to end it has answered, too
        begins_again = told["event"] == "objective"
        if command_id not in self._open and (begins_again or not has_ended):
            self._open[command_id] = self._following(command_id)
        following = self._open.get(command_id)
        if following is not None:
            list(following.take([told]))
        self._finish(command_id, told, at_s)

    def _unheard(self, command_id: str, at_s: float) -> CommandRecord:
        """Return the record of a part of a mission, or of words pushed out of the ring unread."""
        mission_id, part = part_of(command_id)
        mission = self._records.get(mission_id)
        return CommandRecord(
            command_id=command_id,
            source=mission.source if mission else _UNKNOWN,
            text=_words_of(mission, part) if mission else "",
            given_s=at_s,
            mission=mission_id,
        )

    def _finish(self, command_id: str, told: TaskEvent, at_s: float) -> None:
        record = self._records[command_id]
        record.note(told, at_s)
        if self._follow is not None:
            self._follow(record, record.events[-1])
        if record.standing.is_final:
            self._open.pop(command_id, None)

    def _note_lost(self) -> None:
        lost = self._events.lost + self._events.torn
        for command_id in self._open if lost > self._lost else ():
            self._records[command_id].lost_events += lost - self._lost
        if lost > self._lost:
            _log.warning("%d events of commands were lost: too many at once", lost - self._lost)
        self._lost = lost

    def _reasons(self) -> dict[str, str]:
        """Say who works on which command no more: before the drain, which may hold its end."""
        return {name: following.why_lost() for name, following in self._open.items()}

    def _end_lost(self, reasons: dict[str, str]) -> None:
        now_s = self._wall_ns() / NS_PER_S
        for command_id, following in list(self._open.items()):
            last = following.conclude(reasons.get(command_id, ""))
            if last is None and following.is_unanswered:
                last = end_without_actions(command_id, _UNANSWERED)
            if last is not None:
                self._finish(command_id, last, now_s)

    def _wall_s(self, stamp_ns: int) -> float:
        return (self._wall_ns() - self._link.clock.now_ns() + stamp_ns) / NS_PER_S


def _words_of(mission: CommandRecord, part: str) -> str:
    """Return what a mission has said of one of its parts; an objective may have no other part."""
    names = (part, part.partition(".")[0])
    told = (one for one in reversed(mission.events) if one.get("part") in names)
    return next((str(one["words"]) for one in told), "")
