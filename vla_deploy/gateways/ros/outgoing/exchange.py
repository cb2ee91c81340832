"""Exchange one goal with its server: what is sent and comes back does so in the graph's thread.

Steps of the gateway read the attributes; each is set once, but for the feedback.
"""

from collections.abc import Callable
from typing import Any

from rclpy.action import ActionClient
from rclpy.action.client import ClientGoalHandle
from rclpy.task import Future

from vla_deploy.gateways.ros.graph import GraphLink


class GoalExchange:
    """Send a goal and its cancel, and keep what the server says to them."""

    def __init__(self, graph: GraphLink, client: ActionClient, goal: Any) -> None:
        self.is_accepted: bool | None = None
        self.is_cancelling: bool | None = None
        """What the server said to the cancel, None before it said anything."""
        self.result: Any = None
        """The answer with the final status and the result."""
        self.feedback: Any = None
        self.error = ""
        """Why it cannot go on, in words."""
        self._graph = graph
        self._client = client
        self._goal = goal
        self._handle: ClientGoalHandle | None = None
        self._wants_cancel = False

    def send(self) -> None:
        """Queue the goal."""
        self._graph.perform(self._guarded(self._send))

    def cancel(self) -> None:
        """Queue the cancel of the goal; one not answered yet is cancelled once it is accepted."""
        self._graph.perform(self._guarded(self._cancel))

    def _guarded(self, work: Callable[..., None]) -> Callable[..., None]:
        def run(*arguments: Any) -> None:
            try:
                work(*arguments)
            except Exception as error:  # else the graph's thread ends, and with it the gateway
                self.error = f"{type(error).__name__}: {error}"

        return run

    def _send(self) -> None:
        sent = self._client.send_goal_async(self._goal, self._feed)
        sent.add_done_callback(self._guarded(self._answered))

    def _answered(self, sent: Future) -> None:
        handle = sent.result()
        if handle.accepted:
            self._handle = handle
            handle.get_result_async().add_done_callback(self._guarded(self._ended))
            if self._wants_cancel:
                self._cancel()
        self.is_accepted = handle.accepted

    def _cancel(self) -> None:
        self._wants_cancel = True
        if self._handle is not None and self.result is None:
            asked = self._handle.cancel_goal_async()
            asked.add_done_callback(self._guarded(self._cancel_answered))

    def _cancel_answered(self, asked: Future) -> None:
        # A refusal comes with code 0 and an empty list: the list tells.
        self.is_cancelling = bool(asked.result().goals_canceling)

    def _ended(self, got: Future) -> None:
        self.result = got.result()

    def _feed(self, message: Any) -> None:
        self.feedback = message.feedback
