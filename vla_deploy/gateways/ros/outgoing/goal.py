"""Follow one goal of a server beyond the robot, from the wait for the server to the final status.

A cancel is done when the server has answered it and the goal has its final status. Where either
does not come, the goal ends as lost: what it was lent has been taken back before.

What is sent and comes back does so in the graph's thread; steps of the gateway read it.
"""

from collections.abc import Callable
from enum import Enum
from typing import Any, Final

from rclpy.action import ActionClient
from rclpy.action.client import ClientGoalHandle
from rclpy.task import Future

from drivers.clock import NS_PER_S
from vla_deploy.gateways.ros.graph import GraphLink
from vla_deploy.gateways.ros.outgoing.lending import Lending
from vla_deploy.gateways.ros.outgoing.messages import left_of, state_of
from vla_deploy.gateways.ros.part import Due
from vla_deploy.ipc.ros_goals import GoalAnswer, GoalRequest, GoalState

ANSWER_WAIT_S: Final = 5.0
"""How long a server may take to answer a goal, or a cancel."""
FINAL_WAIT_S: Final = 10.0
"""How long the final status may take after a cancel."""
GONE_S: Final = 2.0
"""How long the graph may not know a server before its goal is given up."""
FEEDBACK_HZ: Final = 5.0


class _Stage(Enum):
    WAITING = "waits for its server"
    SENT = "was sent"
    ACTIVE = "is pursued"
    CANCELLING = "is cancelled"
    ENDED = "has ended"


class GoalExchange:
    """Send a goal and its cancel, and keep what the server says to them.

    Each attribute is set once, but for the feedback.
    """

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
        # A refusal comes with code 0 and an empty list: so the list is asked.
        self.is_cancelling = bool(asked.result().goals_canceling)

    def _ended(self, got: Future) -> None:
        self.result = got.result()

    def _feed(self, message: Any) -> None:
        self.feedback = message.feedback


class OutgoingGoal:
    """Pursue one request; `step` is called until `has_ended`."""

    def __init__(
        self,
        request: GoalRequest,
        client: ActionClient,
        exchange: GoalExchange,
        lending: Lending,
        publish: Callable[[GoalAnswer], None],
    ) -> None:
        self.request = request
        self._client = client
        self._exchange = exchange
        self._lending = lending
        self._publish = publish
        self._stage = _Stage.WAITING
        self._begun_ns = 0
        self._since_ns = 0
        self._seen_ns = 0
        self._cancelled = ""
        self._ends_as = GoalState.CANCELLED
        self._cancel_is_published = False
        self._due = Due(FEEDBACK_HZ)

    @property
    def has_ended(self) -> bool:
        """Return whether the final state is published."""
        return self._stage is _Stage.ENDED

    def step(self, now_ns: int) -> None:
        """Go on."""
        self._begun_ns = self._begun_ns or now_ns
        self._since_ns = self._since_ns or now_ns
        if self._exchange.error:
            self.give_up(f"the goal could not be exchanged: {self._exchange.error}")
        elif self._exchange.result is not None:
            self._conclude()
        elif self._stage is _Stage.WAITING:
            self._wait_for_server(now_ns)
        elif self._stage is _Stage.SENT:
            self._wait_for_answer(now_ns)
        elif self._stage is _Stage.ACTIVE:
            self._pursue(now_ns)
        elif self._stage is _Stage.CANCELLING:
            self._wait_for_end(now_ns)

    def cancel(self, reason: str, ends_as: GoalState = GoalState.CANCELLED) -> None:
        """Cancel it; the server may move nothing from now on."""
        self._lending.end(self.request.request_id)
        if self._cancelled or self.has_ended:
            return
        self._cancelled, self._ends_as = reason, ends_as
        if self._stage is _Stage.WAITING:
            self._end(ends_as, f"{reason}; it was not sent yet")
            return
        self._exchange.cancel()
        self._enter(_Stage.CANCELLING)

    def give_up(self, why: str) -> None:
        """End it without the server's word; the server is asked to end it, too."""
        if self._stage not in (_Stage.WAITING, _Stage.CANCELLING, _Stage.ENDED):
            self._exchange.cancel()
        self._end(GoalState.LOST, why)

    def _wait_for_server(self, now_ns: int) -> None:
        if self._client.server_is_ready():
            # Lent before it is sent: a server may begin before its answer is here.
            why = self._lending.lend(self.request)
            if why:
                self._end(GoalState.ABORTED, why)
                return
            self._exchange.send()
            self._seen_ns = now_ns
            self._enter(_Stage.SENT)
        elif self._is_over(self.request.server_wait_s, now_ns):
            self._end(
                GoalState.ABORTED,
                f"{self._name} is not there after {self.request.server_wait_s:g} s; start it, and "
                "see that it has the same ROS_DOMAIN_ID: ros2 action list",
            )

    def _wait_for_answer(self, now_ns: int) -> None:
        accepted = self._exchange.is_accepted
        if accepted is None:
            if self._is_over(ANSWER_WAIT_S, now_ns):
                self.give_up(f"{self._name} did not answer the goal within {ANSWER_WAIT_S:g} s")
            return
        if not accepted:
            self._end(GoalState.REJECTED, f"{self._name} rejected the goal")
            return
        self._enter(_Stage.ACTIVE)
        self._say(GoalState.ACCEPTED)

    def _pursue(self, now_ns: int) -> None:
        if now_ns - self._begun_ns > round(self.request.timeout_s * NS_PER_S):
            why = f"{self._name} took longer than {self.request.timeout_s:g} s"
            self.cancel(why, GoalState.ABORTED)
            return
        self._look_for_server(now_ns)
        feedback = self._exchange.feedback
        if feedback is not None and self._due.is_now(now_ns):
            self._say(GoalState.FEEDBACK, left_m=left_of(feedback))

    def _wait_for_end(self, now_ns: int) -> None:
        if self._exchange.is_accepted is False:
            self._end(GoalState.REJECTED, f"{self._name} rejected the goal")
            return
        answer = self._exchange.is_cancelling
        if answer is not None and not self._cancel_is_published:
            self._cancel_is_published = True
            words = "" if answer else f"{self._name} rejected the cancel"
            self._say(GoalState.CANCELLING if answer else GoalState.CANCEL_REJECTED, words)
        if self._is_over(FINAL_WAIT_S if answer else ANSWER_WAIT_S, now_ns):
            self._end(GoalState.LOST, f"{self._cancelled}; {self._unconfirmed(answer)}")

    def _unconfirmed(self, answer: bool | None) -> str:
        said = {None: "did not answer the cancel", False: "rejected the cancel"}
        what = said.get(answer, f"has not ended it within {FINAL_WAIT_S:g} s")
        return f"{self._name} {what}: it may go on, but moves nothing of this robot"

    def _conclude(self) -> None:
        state, text = state_of(self._exchange.result)
        if state is GoalState.CANCELLED and self._cancelled:
            state = self._ends_as
        said = f"{self._cancelled}; {text}" if self._cancelled and text else text
        self._end(state, said or self._cancelled)

    def _look_for_server(self, now_ns: int) -> None:
        if self._client.server_is_ready():
            self._seen_ns = now_ns
        elif now_ns - self._seen_ns > round(GONE_S * NS_PER_S):
            self.give_up(f"{self._name} has gone while it had the goal")

    @property
    def _name(self) -> str:
        return f"the server {self.request.server}"

    def _is_over(self, limit_s: float, now_ns: int) -> bool:
        return now_ns - self._since_ns > round(limit_s * NS_PER_S)

    def _enter(self, stage: _Stage) -> None:
        self._stage, self._since_ns = stage, 0

    def _end(self, state: GoalState, text: str) -> None:
        self._lending.end(self.request.request_id)
        self._stage = _Stage.ENDED
        self._say(state, text)

    def _say(self, state: GoalState, text: str = "", left_m: float | None = None) -> None:
        request_id = self.request.request_id
        self._publish(GoalAnswer(request_id=request_id, state=state, text=text, left_m=left_m))
