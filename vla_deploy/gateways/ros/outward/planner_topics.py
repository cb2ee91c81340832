"""Publish plans and what becomes of them on the topics of planning nodes, in their JSON.

`PLAN_TOPICS` is the table of topics that carry a plan; each is published when a plan was accepted.
"""

from collections.abc import Callable, Mapping
from typing import Any, Final

from vla_deploy.gateways.ros.commands import CommandNews
from vla_deploy.gateways.ros.graph import JsonTopic
from vla_deploy.gateways.ros.outward.feedback import feedback_of
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
        actions = self._gateway.commands.plan_of(news.record.command_id).actions
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
