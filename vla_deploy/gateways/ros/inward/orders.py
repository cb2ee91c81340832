"""Give commands to the planner as everybody does, and follow them to their end."""

from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final

from vla_deploy.client.command_record import part_of
from vla_deploy.client.following import ANSWER_TIMEOUT_S, Following
from vla_deploy.client.link import RobotLink
from vla_deploy.gateways.words import OrderInvalid
from vla_deploy.ipc import topics
from vla_deploy.ipc.errors import BadPayload
from vla_deploy.ipc.payloads.tasks import TaskEvent, UtteranceContent

_STATUS_AGE_S: Final = 2.0


class CommandOrder:
    """Follow one command; `news` holds what has not been looked at yet."""

    def __init__(self, link: RobotLink, command_id: str) -> None:
        self.command_id = command_id
        self.news: deque[TaskEvent] = deque()
        self.last: TaskEvent | None = None
        self._link = link
        self._following = Following(
            command_id,
            lambda: link.fresh(topics.PLANNER_STATUS, _STATUS_AGE_S),
            lambda: link.fresh(topics.EXECUTOR_STATUS, _STATUS_AGE_S),
            link.clock,
        )

    def cancel(self) -> None:
        """Ask for its end; its last event follows."""
        self._link.utter(cancel=True)

    def take(self, events: list[TaskEvent]) -> None:
        """Take what came since the last step, and find out whether nobody works on it.

        The events of a mission's parts are news of the mission, but do not end it; what a part says
        the mission says, too.
        """
        if self.last is not None:
            return
        why = self._following.why_lost()
        for event in events:
            if self._is_of_part(event):
                if event["event"] != "said":
                    self.news.append(event)
            else:
                self.news.extend(self._following.take((event,)))
        lost = self._following.conclude(why)
        if lost is not None:
            self.news.append(lost)
        if self._following.has_ended and self.news:
            self.last = self.news[-1]
        elif self._following.is_unanswered:
            self.last = {
                "command_id": self.command_id,
                "event": "rejected",
                "reason": f"no answer from planner or executor within {ANSWER_TIMEOUT_S:g} s",
            }
            self.news.append(self.last)

    def _is_of_part(self, event: TaskEvent) -> bool:
        mission, _ = part_of(event["command_id"])
        return mission == self._following.command_id and not self._following.has_ended


class CommandOrders:
    """Give commands, and hand each its events."""

    def __init__(self, link: RobotLink) -> None:
        self._link = link
        self._events = link.events(topics.TASK_EVENT)
        self._orders: list[CommandOrder] = []

    def give(
        self,
        *,
        text: str = "",
        plan: Any = None,
        mission: Any = None,
        source: str = "",
        is_answer: bool = False,
    ) -> CommandOrder:
        """Give a command in words, a plan or a mission to the planner.

        `source` says who gives it, for logs and the audit trail; words that are an answer are no
        command of their own.

        Raises:
            OrderInvalid: it is longer than the planner takes.
        """
        content: UtteranceContent = {"text": text}
        if plan is not None:
            content = {"plan": plan}
        if mission is not None:
            content = {"mission": mission}
        if is_answer:
            content["answer"] = True
        try:
            order = CommandOrder(self._link, self._link.utter(source=source, **content))
        except BadPayload as error:
            raise OrderInvalid(f"too long for a command: {error}") from error
        self._orders.append(order)
        return order

    def step(self) -> None:
        """Hand out the events that came."""
        events = [event.payload for event in self._events.drain()]
        for order in list(self._orders):
            order.take(events)
            if order.last is not None:
                self._orders.remove(order)

    def close(self) -> None:
        """Take back what is under way."""
        for order in self._orders:
            order.cancel()
        self._events.close()


def error_of(last: TaskEvent) -> str:
    """Return in words why a command failed; "" where it did not."""
    if last["event"] == "rejected":
        return last["reason"] or "rejected"
    if last["event"] == "finished" and last["success"]:
        return ""
    return str(last.get("error") or "failed")


@dataclass(frozen=True, slots=True, kw_only=True)
class ActionPlace:
    """Hold which action an event is about, "" for none, and its place in the plan."""

    action_id: str
    index: int
    total: int


class OrderProgress:
    """Count through the plans of a command; an action of a mission's part is "o1.s1/a1"."""

    def __init__(self) -> None:
        self.results: list[dict[str, Any]] = []
        self._places: dict[str, dict[str, int]] = {}

    def note(self, event: TaskEvent) -> ActionPlace:
        """Note an event, and return the action that it is about; `results` has what has ended."""
        _, part = part_of(event["command_id"])
        if event["event"] == "plan":
            actions = event["plan"]["actions"]
            self._places[part] = {one["id"]: place for place, one in enumerate(actions)}
        elif event["event"] == "finished":
            self.results += [{**one, "id": _named(part, one["id"])} for one in event["actions"]]
        action_id = str(event.get("action_id") or "")
        places = self._places.get(part, {})
        return ActionPlace(
            action_id=_named(part, action_id), index=places.get(action_id, 0), total=len(places)
        )


def _named(part: str, action_id: str) -> str:
    return f"{part}/{action_id}" if part and action_id else action_id


def words_of(event: Mapping[str, Any]) -> str:
    """Return what an event says in words: a question, a sentence, an error, "" for nothing."""
    text = event.get("question") or event.get("text") or event.get("error")
    if event["event"] != "objective":
        return str(text or "")
    return f"{event['words']}: {event['state']}" + (f": {text}" if text else "")
