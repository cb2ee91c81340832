"""Follow one command to its end, which may be that nobody is left to plan or carry it out."""

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


Newest = Callable[[], Sample | None]


def follow_command(
    command_id: str,
    *,
    events: Callable[[], Sequence[Event]],
    planner: Newest,
    executor: Newest,
    clock: Clock,
    pause: _Pause,
) -> Iterator[Event]:
    """Return the command's events; the last is `finished` or `rejected`, told or found out.

    `events` drains the ring of task events; `planner` and `executor` return their status while that
    is young. Where the command answers a question, the one that was asked about is followed on.

    Raises:
        CommandFailed: nobody has answered in time.
    """
    watch = Watch("planner", in_planner(command_id), planner, clock)
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
            if event["event"] == "answered":
                command_id = str(event["of"])
                watch = Watch("planner", in_planner(command_id), planner, clock)
            if event["event"] == "plan":
                watch = Watch("executor", in_executor(command_id), executor, clock)
        if why:
            yield lost(command_id, why, actions)
            return
        if not answered and clock.now_ns() > answer_by_ns:
            raise CommandFailed(NO_ANSWER)
        pause()


def in_planner(command_id: str) -> Callable[[Event], bool]:
    """Return what tells whether a planner's status names a command."""
    return lambda status: command_id in status.get("commands", ())


def in_executor(command_id: str) -> Callable[[Event], bool]:
    """Return what tells whether an executor's status names a command."""
    return lambda status: status["command_id"] == command_id


class Watch:
    """Judge by a process' status whether it still works on a command."""

    def __init__(
        self, who: str, has_it: Callable[[Event], bool], status: Newest, clock: Clock
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
        "note": None,
    }
