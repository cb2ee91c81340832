"""Follow commands to their end, which may be that nobody is left to plan or carry them out."""

from collections.abc import Callable, Iterable, Iterator, Mapping
from typing import Any, Final

from drivers.clock import NS_PER_S, Clock
from vla_deploy.client.action_status import UNFINISHED, ActionStatus, summary_of
from vla_deploy.ipc import RingReader, Sample
from vla_deploy.ipc.payloads.tasks import (
    ActionResult,
    ExecutorStatus,
    FinishedEvent,
    PlannerStatus,
    TaskEvent,
)

ANSWER_TIMEOUT_S: Final = 5.0
SILENCE_LIMIT_S: Final = 5.0
LAST_EVENTS: Final = frozenset({"finished", "rejected"})

PlannerLook = Callable[[], Sample[PlannerStatus] | None]
ExecutorLook = Callable[[], Sample[ExecutorStatus] | None]
_LOST: Final = "lost: "
_GIVE_AGAIN: Final = "; look where the robot is, then give the command again"


class Following:
    """Follow one command, look by look.

    A look asks `why_lost` first, takes the new events, and concludes: what has ended a command may
    be told at the moment in which its process ends. An answer to a question is followed on as the
    command that asked.
    """

    def __init__(
        self, command_id: str, planner: PlannerLook, executor: ExecutorLook, clock: Clock
    ) -> None:
        """Begin now; `planner` and `executor` return their status while that is young."""
        self.command_id = command_id
        self.is_answered = False
        self.has_ended = False
        self._planner = planner
        self._executor = executor
        self._clock = clock
        self._watch = Watch("planner", in_planner(command_id), planner, clock)
        self._actions: dict[str, ActionResult] = {}
        self._answer_by_ns = clock.now_ns() + round(ANSWER_TIMEOUT_S * NS_PER_S)

    @property
    def is_unanswered(self) -> bool:
        """Return whether nobody has answered in time."""
        return not self.is_answered and self._clock.now_ns() > self._answer_by_ns

    def why_lost(self) -> str:
        """Return why nobody works on the command, or "" while somebody may."""
        return self._watch.why_lost() if self.is_answered else ""

    def look(self, events: RingReader[TaskEvent]) -> list[TaskEvent]:
        """Return what is new; the last event is made here where nobody works on it any more."""
        why = self.why_lost()
        told = list(self.take([event.payload for event in events.drain()]))
        last = self.conclude(why)
        return told if last is None else [*told, last]

    def take(self, events: Iterable[TaskEvent]) -> Iterator[TaskEvent]:
        """Yield those that are the command's, up to its last one."""
        for event in events:
            if self.has_ended or event.get("command_id") != self.command_id:
                continue
            self._note(event)
            yield event

    def conclude(self, why: str) -> TaskEvent | None:
        """Return the last event of a command that is lost, unless it has ended meanwhile."""
        if self.has_ended or not why:
            return None
        self.has_ended = True
        return lost(self.command_id, why, self._actions)

    def _note(self, event: TaskEvent) -> None:
        self.is_answered = True
        self.has_ended = event["event"] in LAST_EVENTS
        _note_action(self._actions, event)
        if event["event"] == "answered":
            self.command_id = event["of"]
            self._watch = Watch("planner", in_planner(self.command_id), self._planner, self._clock)
        if event["event"] == "plan":
            has_it = in_executor(self.command_id)
            self._watch = Watch("executor", has_it, self._executor, self._clock)


def in_planner(command_id: str) -> Callable[[PlannerStatus], bool]:
    """Return what tells whether a planner's status names a command."""
    return lambda status: command_id in status.get("commands", ())


def in_executor(command_id: str) -> Callable[[ExecutorStatus], bool]:
    """Return what tells whether an executor's status names a command."""
    return lambda status: command_id in status["commands"]


class Watch:
    """Judge by a process' status whether it still works on a command."""

    def __init__(
        self,
        who: str,
        has_it: Callable[[Any], bool],
        status: Callable[[], Sample[Any] | None],
        clock: Clock,
    ) -> None:
        self._who = who
        self._has_it = has_it
        self._status = status
        self._clock = clock
        self._pid: int | None = None
        self._seen_ns: int | None = None

    def why_lost(self) -> str:
        """Return why nobody works on the command, or "" while somebody may."""
        now_ns = self._clock.now_ns()
        sample = self._status()
        if self._seen_ns is None:
            self._seen_ns = now_ns
        if sample is not None and self._has_it(sample.document()):
            self._pid, self._seen_ns = sample.writer_pid, now_ns
        if sample is not None and self._pid not in (None, sample.writer_pid):
            return f"the {self._who} ended while it had the command, and was started again"
        if now_ns - self._seen_ns > SILENCE_LIMIT_S * NS_PER_S:
            return f"the {self._who} has not spoken of the command for {SILENCE_LIMIT_S:g} s"
        return ""


def lost(command_id: str, why: str, actions: Mapping[str, ActionResult]) -> TaskEvent:
    """Return the last event of a command that nobody carries out any more."""
    told: list[ActionResult] = [
        {**action, "status": "lost"} if action["status"] in UNFINISHED else action
        for action in actions.values()
    ]
    return {
        "command_id": command_id,
        "event": "finished",
        "success": False,
        "error": f"{_LOST}{why}{_GIVE_AGAIN}",
        "summary": summary_of(one["status"] for one in told),
        "actions": told,
    }


def is_lost(event: FinishedEvent) -> bool:
    """Return whether `lost` made this event, rather than an action that was lost."""
    error = event["error"] or ""
    return not event["success"] and error.startswith(_LOST) and error.endswith(_GIVE_AGAIN)


def _note_action(actions: dict[str, ActionResult], event: TaskEvent) -> None:
    """Keep the newest word about every action, in the form of the `finished` event."""
    if event["event"] == "plan":
        actions.update({action["id"]: _pending(action) for action in event["plan"]["actions"]})
    if event["event"] == "action":
        actions[event["action_id"]] = {
            "id": event["action_id"],
            "skill": event["skill"],
            "parameters": event["parameters"],
            "status": event["status"],
            "execution_time_s": event.get("execution_time_s", 0.0),
            "error": event.get("error"),
            "retries": event.get("retries", 0),
            "note": event.get("note"),
            "data": event.get("data", {}),
        }


def _pending(action: Mapping[str, Any]) -> ActionResult:
    return {
        "id": action["id"],
        "skill": action["skill"],
        "parameters": action["parameters"],
        "status": ActionStatus.PENDING.value,
        "execution_time_s": 0.0,
        "error": None,
        "retries": 0,
        "note": None,
        "data": {},
    }
