"""Publish plans and what becomes of them on the topics of planning nodes, in their JSON.

`PLAN_TOPICS` is the table of topics that carry a plan; each is published when a plan was accepted.
Feedback has `status`: success, failure, timeout, error or question; `stage`: planning or execution;
the `command`, its `command_id` and `source`.
"""

from collections.abc import Callable, Mapping
from typing import Any, Final

from vla_deploy.gateways.ros.commands import CommandNews
from vla_deploy.gateways.ros.graph import JsonTopic
from vla_deploy.gateways.ros.outward.plan_dialects import (
    Where,
    ranked_actions,
    resolved_actions,
    terse_action,
    terse_plan,
)
from vla_deploy.gateways.ros.outward.scene import Locator
from vla_deploy.gateways.ros.part import Gateway, GatewayPart

CURRENT_ACTION: Final = "/cognitive_planner/current_action"
_LATE: Final = "late"
_UNANSWERED: Final = "lost: no answer"


def _list(news: CommandNews, where: Where) -> Any:
    return ranked_actions(news.event["plan"], where)


def _of_command(news: CommandNews, where: Where) -> Any:
    return {
        "original_command": _command(news),
        "action_sequence": ranked_actions(news.event["plan"], where),
        "timestamp": news.event["at_s"],
    }


def _resolved(news: CommandNews, where: Where) -> Any:
    actions, log = resolved_actions(news.event["plan"], where)
    return {
        "original_command": _command(news),
        "action_sequence": actions,
        "resolution_log": log,
        "timestamp": news.event["at_s"],
    }


def _terse(news: CommandNews, where: Where) -> Any:
    return {**terse_plan(news.event["plan"]), "command_id": news.record.command_id}


def _command(news: CommandNews) -> Mapping[str, Any]:
    record = news.record
    return {
        "original_command": record.text or str(news.event["plan"]["goal"]),
        "timestamp": round(record.given_s, 3),
        "source": record.source,
        "command_id": record.command_id,
    }


PLAN_TOPICS: Final[Mapping[str, Callable[[CommandNews, Where], Any]]] = {
    "/cognitive_planner/action_sequence": _list,
    "/optimized_planner/action_sequence": _list,
    "/llm_planner/action_sequence": _of_command,
    "/context_aware_planner/resolved_commands": _resolved,
    "/cognitive_planner/plan": _terse,
}


class PlannerTopics(GatewayPart):
    """Publish plans, the action that begins, and feedback, as they come."""

    def __init__(self, gateway: Gateway, locator: Locator) -> None:
        graph = gateway.graph
        self._gateway = gateway
        self._locator = locator
        self._plans = {topic: JsonTopic(graph, topic) for topic in PLAN_TOPICS}
        self._action = JsonTopic(graph, CURRENT_ACTION)

    def step(self, now_ns: int) -> None:
        """Publish what is new of every command."""
        for news in self._gateway.commands.news:
            if news.event.get("event") == "plan":
                for topic, write in PLAN_TOPICS.items():
                    self._plans[topic].publish(write(news, self._locator.where))
            if news.event.get("event") == "action" and news.event.get("status") == "active":
                self._publish_action(news)
            feedback = feedback_of(news)
            if feedback is not None:
                self._gateway.feedback.publish(feedback)

    def _publish_action(self, news: CommandNews) -> None:
        event = news.event
        actions = self._gateway.commands.current.actions
        planned = next((one for one in actions if one["id"] == event.get("action_id")), {})
        self._action.publish(
            {
                **terse_action({**planned, **event}),
                "action_id": event.get("action_id"),
                "command_id": event.get("command_id"),
                "status": event.get("status"),
                "retries": event.get("retries", 0),
            }
        )


def feedback_of(news: CommandNews) -> dict[str, Any] | None:
    """Return what feedback an event is worth, None for most."""
    write = _WRITERS.get(str(news.event.get("event")))
    if write is None:
        return None
    record = news.record
    goal = str(record.plan.get("goal", "")) if isinstance(record.plan, dict) else ""
    head = {
        "command": record.text or goal,
        "command_id": record.command_id,
        "source": record.source,
    }
    return {**write(news), **head}


def _planned(news: CommandNews) -> dict[str, Any]:
    return {
        "status": "success",
        "stage": "planning",
        "actions_planned": len(news.event["plan"]["actions"]),
        "processing_time": _took_s(news),
        "planned_by": str(news.event.get("rung", "")),
    }


def _took_s(news: CommandNews) -> float:
    return float(round(max(news.event["at_s"] - news.record.given_s, 0.0), 3))


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
    late = bool(attempts) and attempts[-1].get("outcome") == _LATE
    return {
        "status": "timeout" if late else "failure",
        "stage": "planning",
        "error": str(news.event.get("reason") or "rejected"),
        "processing_time": _took_s(news),
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
