"""Follow one goal of a server beyond the robot, from the wait for the server to the final status.

A cancel is done when the server has answered it and the goal has its final status. Where either
does not come, the goal ends as lost: what it was lent has been taken back before.
"""

from collections.abc import Callable
from enum import Enum
from typing import Final

from rclpy.action import ActionClient

from drivers.clock import NS_PER_S
from vla_deploy.gateways.ros.outgoing.exchange import GoalExchange
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


class OutgoingGoal:
    """Pursue one request; `step` is called until `has_ended`."""

    def __init__(
        self,
        request: GoalRequest,
        client: ActionClient,
        exchange: GoalExchange,
        lending: Lending,
        tell: Callable[[GoalAnswer], None],
    ) -> None:
        self.request = request
        self._client = client
        self._exchange = exchange
        self._lending = lending
        self._tell = tell
        self._stage = _Stage.WAITING
        self._begun_ns = 0
        self._since_ns = 0
        self._seen_ns = 0
        self._cancelled = ""
        self._ends_as = GoalState.CANCELLED
        self._cancel_is_told = False
        self._due = Due(FEEDBACK_HZ)

    @property
    def has_ended(self) -> bool:
        """Return whether the final state is told."""
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
        if answer is not None and not self._cancel_is_told:
            self._cancel_is_told = True
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
        self._tell(GoalAnswer(request_id=request_id, state=state, text=text, left_m=left_m))
