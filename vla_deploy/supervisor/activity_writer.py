"""Publish what the robot does, in one word; the supervisor outlives all that it judges by."""

from typing import Any, Final

from drivers.clock import NS_PER_S, Clock
from vla_deploy.client.activity import ProcessStatuses, RobotActivity, activity_of
from vla_deploy.ipc import CellReader, Event, SharedSpace, topics
from vla_deploy.ipc.payloads.tasks import TaskEvent

LOOK_NS: Final = NS_PER_S // 10
AGAIN_NS: Final = NS_PER_S // 2
# How old a status may be: a few of its periods, so that a busy computer makes nobody silent.
CONTROL_S: Final = 1.0
EXECUTOR_S: Final = 2.0
PLANNER_S: Final = 3.0
SPEECH_S: Final = 2.0
_MOST_UNDER_WAY: Final = 64
_MOST_CHARACTERS: Final = 200


class ActivityWriter:
    """Write the `activity` cell: at once where it changes, else twice a second."""

    def __init__(self, space: SharedSpace, clock: Clock) -> None:
        self._clock = clock
        self._control = space.cell_reader(topics.CONTROL_STATUS)
        self._executor = space.cell_reader(topics.EXECUTOR_STATUS)
        self._planner = space.cell_reader(topics.PLANNER_STATUS)
        self._speech = space.cell_reader(topics.SPEECH_STATUS)
        self._events = space.ring_reader(topics.TASK_EVENT, from_start=False)
        self._cell = space.cell_writer(topics.ACTIVITY)
        self._under_way: dict[str, None] = {}
        self._succeeded_ns: int | None = None
        self._written: tuple[RobotActivity, str] | None = None
        self._since_ns = 0
        self._look_due_ns = 0
        self._again_due_ns = 0

    def step(self, refusal: str) -> None:
        """Look, if it is time; `refusal` is why no command is taken, "" where they are."""
        now_ns = self._clock.now_ns()
        if now_ns < self._look_due_ns:
            return
        self._look_due_ns = now_ns + LOOK_NS
        for event in self._events.drain():
            self._follow(event)
        seen = self._statuses(now_ns, refusal)
        told = activity_of(seen), seen.stopped_by[:_MOST_CHARACTERS]
        if told == self._written and now_ns < self._again_due_ns:
            return
        if self._written is None or told[0] is not self._written[0]:
            self._since_ns = now_ns
        self._written, self._again_due_ns = told, now_ns + AGAIN_NS
        activity, stopped_by = told
        self._cell.put_document(
            {
                "activity": activity.value,
                "stopped_by": stopped_by,
                "since_ns": self._since_ns,
            }
        )

    def _statuses(self, now_ns: int, refusal: str) -> ProcessStatuses:
        succeeded_ns = self._succeeded_ns
        return ProcessStatuses(
            control=_young(self._control, now_ns, CONTROL_S),
            executor=_young(self._executor, now_ns, EXECUTOR_S),
            planner=_young(self._planner, now_ns, PLANNER_S),
            speech=_young(self._speech, now_ns, SPEECH_S),
            refusal=refusal,
            succeeded_s=None if succeeded_ns is None else (now_ns - succeeded_ns) / NS_PER_S,
        )

    def _follow(self, event: Event[TaskEvent]) -> None:
        """Note what has ended well; a halt succeeds too, but has no plan and completes nothing."""
        told = event.payload
        if told["event"] == "plan":
            self._under_way[told["command_id"]] = None
            while len(self._under_way) > _MOST_UNDER_WAY:
                del self._under_way[next(iter(self._under_way))]
        elif told["event"] == "finished":
            had_plan = told["command_id"] in self._under_way
            self._under_way.pop(told["command_id"], None)
            is_done = had_plan and bool(told.get("success"))
            self._succeeded_ns = event.stamp_ns if is_done else None


def _young(reader: CellReader[Any], now_ns: int, age_limit_s: float) -> dict[str, Any] | None:
    sample = reader.latest()
    if sample is None or sample.age_s(now_ns) > age_limit_s:
        return None
    document: dict[str, Any] = sample.document()
    return document
