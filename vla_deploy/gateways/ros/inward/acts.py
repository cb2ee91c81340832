"""Serve the operator's acts: estop, reset, arm, disarm, each an act of its own.

A press of the stop does not wait for a step of the gateway.
"""

import logging
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any, Final

from rclpy.task import Future
from std_msgs.msg import Bool
from std_srvs.srv import Trigger

from drivers.clock import NS_PER_S
from vla_deploy.client.acts import REACHED, why_not
from vla_deploy.client.link import RobotLink
from vla_deploy.gateways.ros.part import Gateway, GatewayPart
from vla_deploy.ipc.payloads.motion import OperatorActName
from vla_deploy.ipc.stop_button import ESTOP

EMERGENCY_STOP: Final = "/emergency_stop"
LOOKS: Final = 50
"""Steps in which the name of who asks for a reset or to arm is waited for: neither is urgent."""
WAIT_S: Final = 5.0
_log = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True, kw_only=True)
class _Asked:
    act: OperatorActName
    service: str
    answer: Future
    deadline_ns: int


class Acts(GatewayPart):
    """Hand acts to control, and answer when control shows them."""

    def __init__(self, gateway: Gateway, acts: tuple[OperatorActName, ...]) -> None:
        graph, link = gateway.graph, gateway.link
        self._gateway = gateway
        # Of the graph's thread alone: what a thread writes with is its own.
        self._presses = RobotLink(link.run_dir, link.clock, source=link.source, robot=link.robot)
        self._asked: list[_Asked] = []
        for act in acts:
            graph.serve(Trigger, f"/vla_deploy/{act}", self._handler(act, f"/vla_deploy/{act}"))
        if ESTOP in acts:
            graph.serve(Trigger, EMERGENCY_STOP, self._handler(ESTOP, EMERGENCY_STOP))
            graph.node.create_subscription(Bool, EMERGENCY_STOP, self._pressed, 10)

    def step(self, now_ns: int) -> None:
        """Answer what control shows, or has not shown in time."""
        if not self._asked:
            return
        status = self._gateway.control_status()
        for asked in list(self._asked):
            done = status is not None and REACHED[asked.act](status)
            if done or now_ns >= asked.deadline_ns:
                self._asked.remove(asked)
                asked.answer.set_result(
                    Trigger.Response(success=done, message="" if done else why_not(status))
                )

    def stop(self) -> None:
        """Leave nobody without an answer."""
        for asked in self._asked:
            asked.answer.set_result(
                Trigger.Response(success=False, message="the gateway was stopped")
            )
        self._asked.clear()
        self._presses.close()

    def _handler(self, act: OperatorActName, service: str) -> Callable[[Any], Future]:
        def handle(_request: Any) -> Future:
            answer = self._gateway.graph.future()
            if act == ESTOP:
                self._press(f"the service {service}", self._gateway.link.source)
            deadline_ns = self._gateway.link.clock.now_ns() + round(WAIT_S * NS_PER_S)
            asked = _Asked(act=act, service=service, answer=answer, deadline_ns=deadline_ns)
            if not self._gateway.graph.put(lambda: self._take(asked)):
                answer.set_result(Trigger.Response(success=False, message="too many requests"))
            return answer

        return handle

    def _take(self, asked: _Asked) -> None:
        graph = self._gateway.graph
        if asked.act == ESTOP:
            self._asked.append(asked)
        else:
            find, act = partial(graph.caller, asked.service), partial(self._operate, asked)
            graph.when_named(find, act, looks=LOOKS)

    def _operate(self, asked: _Asked, caller: str) -> None:
        self._gateway.link.operate(asked.act, "over ROS", caller)
        self._asked.append(asked)

    def _pressed(self, message: Bool) -> None:
        if message.data:
            sender = self._gateway.graph.sender(EMERGENCY_STOP)
            self._press(f"the topic {EMERGENCY_STOP}", sender)

    def _press(self, reason: str, source: str) -> None:
        self._presses.operate(ESTOP, reason, source)
        _log.warning("stop pressed by %s: %s", source, reason)
