"""Follow the commands of every source, for the parts that publish what becomes of them."""

from collections import deque
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Final

from vla_deploy.client.action_status import FINAL
from vla_deploy.client.command_history import CommandHistory
from vla_deploy.client.command_record import CommandRecord, Kind
from vla_deploy.client.following import LAST_EVENTS
from vla_deploy.client.link import RobotLink

MOST_RECENT: Final = 5
"""Of the actions that ended last."""


@dataclass(frozen=True, slots=True, kw_only=True)
class CommandNews:
    """Hold one event of a command, and the command as it stands since."""

    record: CommandRecord
    event: Mapping[str, Any]


@dataclass(slots=True, kw_only=True)
class PlanUnderWay:
    """Hold the plan of a command, its words, and how each action stands, by its id."""

    text: str = ""
    actions: Sequence[Mapping[str, Any]] = ()
    statuses: dict[str, str] = field(default_factory=dict)
    has_begun: bool = False


class RobotCommands:
    """Hold the news of this step, the plan under way, and the actions that ended last."""

    def __init__(self, link: RobotLink, ros_ns: Callable[[], int]) -> None:
        """Begin now; `ros_ns` returns the present in ROS time."""
        self.news: tuple[CommandNews, ...] = ()
        self.recent: deque[dict[str, Any]] = deque(maxlen=MOST_RECENT)
        self.has_succeeded: bool | None = None
        self._under_way: dict[str, PlanUnderWay] = {}
        self._coming: list[CommandNews] = []
        self._history = CommandHistory(link, ros_ns, self._follow)

    @property
    def current(self) -> PlanUnderWay:
        """Return what the executor has begun, else what it was given; an empty one for nothing."""
        found = list(self._under_way.values())
        begun = (one for one in found if one.has_begun)
        return next(begun, found[0] if found else PlanUnderWay())

    def plan_of(self, command_id: str) -> PlanUnderWay:
        """Return the plan of one command; an empty one for none."""
        return self._under_way.get(command_id, PlanUnderWay())

    @property
    def actions_left(self) -> int:
        """Return how many actions of the plan under way have not ended."""
        return sum(status not in FINAL for status in self.current.statuses.values())

    def step(self, now_ns: int) -> None:
        """Take what is new; `news` is of this step alone."""
        self._history.step()
        self.news, self._coming = tuple(self._coming), []

    def stop(self) -> None:
        """Close the topics."""
        self._history.stop()

    def _follow(self, record: CommandRecord, event: dict[str, Any]) -> None:
        self._coming.append(CommandNews(record=record, event=event))
        name, command_id = event.get("event"), record.command_id
        if name == "plan":
            plan = event["plan"]
            self._under_way[command_id] = PlanUnderWay(
                text=record.text or str(plan["goal"]),
                actions=plan["actions"],
                statuses={one["id"]: "pending" for one in plan["actions"]},
            )
        elif name == "action":
            self._note_action(command_id, event)
        elif name in LAST_EVENTS and record.kind is Kind.COMMAND:
            self._end(command_id, event)

    def _end(self, command_id: str, event: Mapping[str, Any]) -> None:
        was_under_way = self._under_way.pop(command_id, None) is not None
        success = bool(event.get("success"))
        if was_under_way or not success:  # a stop succeeds, but completes nothing
            self.has_succeeded = success

    def _note_action(self, command_id: str, event: Mapping[str, Any]) -> None:
        under_way = self._under_way.get(command_id)
        if under_way is not None:
            under_way.has_begun = True
            under_way.statuses[str(event.get("action_id"))] = str(event.get("status"))
        if event.get("status") in FINAL:
            keys = ("skill", "parameters", "status", "execution_time_s", "error")
            self.recent.append({key: event.get(key) for key in keys})
