"""Publish on the planners' feedback topics what becomes of commands.

Each message has `status`: success, failure, timeout, error or question; `stage`: planning or
execution; the `command`, its `command_id` and `source`.
"""

from collections.abc import Callable, Mapping
from typing import Any, Final

from vla_deploy.gateways.ros.commands import CommandNews
from vla_deploy.gateways.ros.graph import GraphLink
from vla_deploy.gateways.ros.json_topic import JsonTopic

TOPICS: Final = ("/cognitive_planner/feedback", "/llm_planner/feedback")
_LATE: Final = ("late",)
_UNANSWERED: Final = "lost: no answer"


class CommandFeedback:
    """Publish the same on both topics."""

    def __init__(self, graph: GraphLink) -> None:
        self._topics = tuple(JsonTopic(graph, topic) for topic in TOPICS)

    def tell(self, document: Mapping[str, Any]) -> None:
        """Publish what became of a command."""
        for topic in self._topics:
            topic.tell(dict(document))

    def refuse(self, command: str, source: str, topic: str, why: str) -> None:
        """Publish why something that came on a topic is no command; nothing was done by it."""
        self.tell(
            {
                "status": "error",
                "stage": "planning",
                "command": command,
                "command_id": "",
                "source": source,
                "topic": topic,
                "error": why,
            }
        )


def feedback_of(news: CommandNews) -> dict[str, Any] | None:
    """Return what feedback an event is worth, None for most."""
    write = _WRITERS.get(str(news.event.get("event")))
    if write is None:
        return None
    record = news.record
    head = {
        "command": record.text or _goal(record.plan),
        "command_id": record.command_id,
        "source": record.source,
    }
    return {**write(news), **head}


def _goal(plan: Any) -> str:
    return str(plan.get("goal", "")) if isinstance(plan, dict) else ""


def _planned(news: CommandNews) -> dict[str, Any]:
    return {
        "status": "success",
        "stage": "planning",
        "actions_planned": len(news.event["plan"]["actions"]),
        "processing_time": round(max(news.event["at_s"] - news.record.given_s, 0.0), 3),
        "planned_by": str(news.event.get("rung", "")),
    }


def _asked(news: CommandNews) -> dict[str, Any]:
    return {
        "status": "question",
        "stage": "planning",
        "question": str(news.event.get("question", "")),
        "choices": list(news.event.get("choices") or ()),
        "answer_within_s": news.event.get("answer_within_s"),
    }


def _rejected(news: CommandNews) -> dict[str, Any]:
    attempts = list(news.event.get("attempts") or ())
    late = bool(attempts) and attempts[-1].get("outcome") in _LATE
    return {
        "status": "timeout" if late else "failure",
        "stage": "planning",
        "error": str(news.event.get("reason") or "rejected"),
        "processing_time": round(max(news.event["at_s"] - news.record.given_s, 0.0), 3),
    }


def _finished(news: CommandNews) -> dict[str, Any]:
    actions = news.event.get("actions") or ()
    error = str(news.event.get("error") or "")
    status = "success" if news.event.get("success") else "failure"
    if error.startswith(_UNANSWERED):
        status = "timeout"
    elif error.startswith("lost"):
        status = "error"
    succeeded = sum(one["status"] == "succeeded" for one in actions)
    return {
        "status": status,
        "stage": "execution",
        **({"error": error} if error else {}),
        "summary": {
            "total_actions": len(actions),
            "successful_actions": succeeded,
            "failed_actions": len(actions) - succeeded,
            "success_rate": succeeded / len(actions) if actions else 0.0,
        },
    }


_WRITERS: Final[Mapping[str, Callable[[CommandNews], dict[str, Any]]]] = {
    "plan": _planned,
    "asked": _asked,
    "rejected": _rejected,
    "finished": _finished,
}
