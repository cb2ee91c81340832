"""Follow one command to its end, which may be that nobody is left to carry it out."""

from collections.abc import Callable, Iterator, Sequence
from typing import Any, Protocol

from drivers.clock import NS_PER_S, Clock
from vla_deploy.cli.errors import CommandFailed
from vla_deploy.ipc import Sample
from vla_deploy.planning.plan import ActionStatus

ANSWER_TIMEOUT_S = 5.0
SILENCE_LIMIT_S = 5.0
LAST_EVENTS = frozenset({"finished", "rejected"})
NO_ANSWER = (
    f"no answer from planner or executor within {ANSWER_TIMEOUT_S:g} s, the command is not carried "
    "out; see: vla-deploy status, and to stop the robot at once: vla-deploy estop"
)
_UNFINISHED = frozenset({ActionStatus.PENDING.value, ActionStatus.ACTIVE.value})

Event = dict[str, Any]


class _Pause(Protocol):
    def __call__(self) -> None: ...


def follow_command(
    command_id: str,
    *,
    events: Callable[[], Sequence[Event]],
    executor: Callable[[], Sample | None],
    clock: Clock,
    pause: _Pause,
) -> Iterator[Event]:
    """Return the command's events; the last is `finished` or `rejected`, told or found out.

    `events` drains the ring of task events, `executor` returns its status while that is young.

    Raises:
        CommandFailed: nobody has answered in time.
    """
    watch = ExecutorWatch(command_id, executor, clock)
    actions: dict[str, Event] = {}
    answer_by_ns = clock.now_ns() + round(ANSWER_TIMEOUT_S * NS_PER_S)
    answered = False
    while True:
        why = watch.why_lost() if answered else ""  # before the drain, which may hold the end
        for event in events():
            if event.get("command_id") != command_id:
                continue
            answered = True
            _note(actions, event)
            yield event
            if event["event"] in LAST_EVENTS:
                return
        if why:
            yield lost(command_id, why, actions)
            return
        if not answered and clock.now_ns() > answer_by_ns:
            raise CommandFailed(NO_ANSWER)
        pause()


class ExecutorWatch:
    """Judge by the executor's status whether it still carries a command out."""

    def __init__(
        self, command_id: str, executor: Callable[[], Sample | None], clock: Clock
    ) -> None:
        self._command_id = command_id
        self._executor = executor
        self._clock = clock
        self._pid: int | None = None
        self._seen_ns: int | None = None

    def why_lost(self) -> str:
        """Return why nobody carries the command out, or "" while somebody may."""
        now_ns = self._clock.now_ns()
        sample = self._executor()
        if self._seen_ns is None:
            self._seen_ns = now_ns
        if sample is not None and sample.document()["command_id"] == self._command_id:
            self._pid, self._seen_ns = sample.writer_pid, now_ns
        if sample is not None and self._pid not in (None, sample.writer_pid):
            return "the executor ended while it carried the command out, and was started again"
        if now_ns - self._seen_ns > SILENCE_LIMIT_S * NS_PER_S:
            return f"the executor has not spoken of the command for {SILENCE_LIMIT_S:g} s"
        return ""


def lost(command_id: str, why: str, actions: dict[str, Event]) -> Event:
    """Return the last event of a command that nobody carries out any more."""
    told = [
        action | {"status": ActionStatus.LOST.value} if action["status"] in _UNFINISHED else action
        for action in actions.values()
    ]
    return {
        "command_id": command_id,
        "event": "finished",
        "success": False,
        "error": f"lost: {why}; look where the robot is, then give the command again",
        "actions": told,
    }


def _note(actions: dict[str, Event], event: Event) -> None:
    """Keep the newest word about every action, in the form of the `finished` event."""
    if event["event"] == "plan":
        actions.update({action["id"]: _pending(action) for action in event["plan"]["actions"]})
    if event["event"] == "action":
        told = {key: value for key, value in event.items() if key not in ("command_id", "event")}
        identity = told.pop("action_id")
        actions[identity] = {"id": identity} | told


def _pending(action: Event) -> Event:
    return {
        "id": action["id"],
        "skill": action["skill"],
        "parameters": action["parameters"],
        "status": ActionStatus.PENDING.value,
        "execution_time_s": 0.0,
        "error": None,
        "retries": 0,
    }
