"""Serve an action: each goal is pursued step by step, and ends with a state and a result.

Goals are judged and pursued in the gateway's steps; the graph's thread only waits for the outcome.
"""

from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum
from typing import Any, Final, Protocol

from rclpy.action import ActionServer, CancelResponse, GoalResponse
from rclpy.action.server import ServerGoalHandle
from rclpy.task import Future

from vla_deploy.client.readiness import refusal_of
from vla_deploy.gateways.ros.part import Gateway

MOST_AT_A_TIME: Final = 8
Feedback = Callable[[Any], None]


class GoalEnding(Enum):
    """Name how a goal ends, in the words of action_msgs/GoalStatus."""

    SUCCEEDED = "succeed"
    ABORTED = "abort"
    CANCELED = "canceled"


@dataclass(frozen=True, slots=True, kw_only=True)
class GoalOutcome:
    """Describe how a goal ended, and what its client gets."""

    ending: GoalEnding
    result: Any


class GoalRefused(Exception):
    """Report why a goal is not taken up, with the action's code."""

    def __init__(self, code: int, text: str) -> None:
        super().__init__(text)
        self.code = code


class Pursuit(Protocol):
    """Pursue one goal."""

    def step(self, now_ns: int) -> GoalOutcome | None:
        """Go on; return the outcome once there is one."""
        ...

    def cancel(self, reason: str, *, superseded: bool = False) -> GoalOutcome | None:
        """End it for a reason; None where `step` returns the outcome later.

        One that is superseded leaves what it moves to its successor.
        """
        ...


class ServedAction(Protocol):
    """Judge the goals of one action, and begin those that are sound."""

    @property
    def kind(self) -> Any:
        """Return the type of the action."""
        ...

    def judge(self, goal: Any) -> Any:
        """Return what of a goal `begin` needs; nothing moves by that.

        Raises:
            GoalRefused: it is malformed, or the robot may not move now.
        """
        ...

    def begin(self, judged: Any, feedback: Feedback) -> Pursuit:
        """Begin with a goal.

        Raises:
            GoalRefused: what it needs is not free.
        """
        ...

    def refused(self, refusal: GoalRefused) -> Any:
        """Return the result of a goal that is not taken up."""
        ...


def require_armed(gateway: Gateway, code: int, *, disarmed: int | None = None) -> None:
    """Refuse a goal with a code, or with the one for a robot that is `disarmed`.

    Raises:
        GoalRefused: the robot may not move now.
    """
    status = gateway.control_status()
    why = refusal_of(status)
    if why:
        is_disarmed = status is not None and status["state"] == "disarmed"
        raise GoalRefused(code if disarmed is None or not is_disarmed else disarmed, why)


@dataclass(slots=True, kw_only=True, eq=False)
class _Goal:
    handle: ServerGoalHandle
    done: Future
    pursuit: Pursuit
    cancelling: bool = False


class GoalServer:
    """Take the goals of one action; a sound new goal ends the one before it, as usual in ROS."""

    def __init__(self, gateway: Gateway, name: str, action: ServedAction) -> None:
        self._graph = gateway.graph
        self._action = action
        self._goals: list[_Goal] = []
        self._graph.act(
            ActionServer(
                self._graph.node,
                action.kind,
                name,
                execute_callback=self._execute,
                goal_callback=self._admit,
                cancel_callback=lambda _handle: CancelResponse.ACCEPT,
            )
        )

    def step(self, now_ns: int) -> None:
        """Go on with every goal."""
        for goal in list(self._goals):
            outcome = None
            if goal.handle.is_cancel_requested and not goal.cancelling:
                goal.cancelling = True
                outcome = goal.pursuit.cancel("cancelled on request")
            outcome = outcome or goal.pursuit.step(now_ns)
            if outcome is not None:
                self._end(goal, outcome)

    def stop(self) -> None:
        """End every goal, because the gateway ends."""
        self._cancel_all("the gateway was stopped")

    def _admit(self, _request: Any) -> GoalResponse:
        full = len(self._goals) >= MOST_AT_A_TIME
        return GoalResponse.REJECT if full else GoalResponse.ACCEPT

    async def _execute(self, handle: ServerGoalHandle) -> Any:
        done = self._graph.future()
        if not self._graph.put(lambda: self._start(handle, done)):
            handle.abort()
            return self._action.kind.Result()
        outcome: GoalOutcome = await done
        state = outcome.ending
        # A goal that ends by itself while its cancelling is asked for may end as it did.
        if state is GoalEnding.CANCELED and not handle.is_cancel_requested:
            state = GoalEnding.ABORTED
        getattr(handle, state.value)()
        return outcome.result

    def _start(self, handle: ServerGoalHandle, done: Future) -> None:
        try:
            judged = self._action.judge(handle.request)
            self._cancel_all("a newer goal took its place", superseded=True)
            pursuit = self._action.begin(judged, handle.publish_feedback)
        except GoalRefused as refusal:
            result = self._action.refused(refusal)
            done.set_result(GoalOutcome(ending=GoalEnding.ABORTED, result=result))
            return
        self._goals.append(_Goal(handle=handle, done=done, pursuit=pursuit))

    def _cancel_all(self, reason: str, *, superseded: bool = False) -> None:
        for goal in list(self._goals):
            outcome = goal.pursuit.cancel(reason, superseded=superseded)
            if outcome is not None:
                self._end(goal, outcome)

    def _end(self, goal: _Goal, outcome: GoalOutcome) -> None:
        self._goals.remove(goal)
        goal.done.set_result(outcome)
