"""Carry the executor's goals to servers beyond the robot, and what they say back to it."""

import logging
from collections.abc import Mapping
from typing import Any, Final

from rclpy.action import ActionClient

from vla_deploy.gateways.ros.outgoing.goal import GoalExchange, OutgoingGoal
from vla_deploy.gateways.ros.outgoing.lending import Lending
from vla_deploy.gateways.ros.outgoing.messages import ACTIONS, goal_of
from vla_deploy.gateways.ros.part import Gateway
from vla_deploy.ipc import topics
from vla_deploy.ipc.ros_goals import (
    GoalAct,
    GoalAnswer,
    GoalKind,
    GoalRequest,
    GoalState,
    RosGoalUnreadable,
    read_request,
)

MOST_GOALS: Final = 8
_log = logging.getLogger(__name__)


class Courier:
    """Pursue the goals in their order, one at a time with each server."""

    def __init__(self, gateway: Gateway, lending: Lending) -> None:
        self._gateway = gateway
        self._lending = lending
        self._requests = gateway.link.events(topics.ROS_REQUEST)
        self._clients: dict[tuple[GoalKind, str], ActionClient] = {}
        self._goals: dict[str, OutgoingGoal] = {}

    def step(self, now_ns: int) -> None:
        """Take what the executor asks, and go on with every goal whose turn it is."""
        for event in self._requests.drain():
            self._take(event.payload)
        for request_id, why in self._lending.step(now_ns).items():
            if request_id in self._goals:
                self._goals[request_id].cancel(why)
        busy: set[str] = set()
        for request_id, goal in list(self._goals.items()):
            if goal.request.server in busy:
                continue  # a second goal would end the first
            busy.add(goal.request.server)
            goal.step(now_ns)
            if goal.has_ended:
                del self._goals[request_id]

    def stop(self) -> None:
        """Cancel every goal and give it up: nobody will hear how it ends."""
        for goal in self._goals.values():
            goal.give_up("the ROS gateway was stopped")
        self._goals.clear()
        self._requests.close()

    def _take(self, document: Mapping[str, Any]) -> None:
        act, request_id = document.get("act"), str(document.get("request_id"))
        if act == GoalAct.SEND:
            self._begin(document)
        elif act == GoalAct.CANCEL and request_id in self._goals:
            self._cancel(request_id, str(document.get("reason", "")))
        elif act in (GoalAct.PERMIT, GoalAct.HOLD):
            self._lending.permit(request_id, drives=act == GoalAct.PERMIT)

    def _begin(self, document: Mapping[str, Any]) -> None:
        try:
            request = read_request(document)
        except RosGoalUnreadable as error:
            _log.error("%s", error)
            self._refuse(str(document.get("request_id")), str(error))
            return
        if len(self._goals) >= MOST_GOALS:
            self._refuse(request.request_id, f"{MOST_GOALS} goals are under way already")
            return
        graph, client = self._gateway.graph, self._client(request)
        exchange = GoalExchange(graph, client, goal_of(request, self._gateway.time))
        goal = OutgoingGoal(request, client, exchange, self._lending, self._answer)
        self._goals[request.request_id] = goal

    def _cancel(self, request_id: str, reason: str) -> None:
        goal = self._goals[request_id]
        goal.cancel(reason or "cancelled by the executor")
        if goal.has_ended:
            del self._goals[request_id]

    def _client(self, request: GoalRequest) -> ActionClient:
        key = request.kind, request.server
        if key not in self._clients:
            node = self._gateway.graph.node
            self._clients[key] = ActionClient(node, ACTIONS[request.kind], request.server)
            self._gateway.graph.act(self._clients[key])
        return self._clients[key]

    def _refuse(self, request_id: str, why: str) -> None:
        self._answer(GoalAnswer(request_id=request_id, state=GoalState.REJECTED, text=why))

    def _answer(self, answer: GoalAnswer) -> None:
        if answer.text:
            _log.info("goal %s %s: %s", answer.request_id, answer.state.value, answer.text)
        self._gateway.link.writer(topics.ROS_ANSWER).publish(answer.document())
