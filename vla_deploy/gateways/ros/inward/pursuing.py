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

from vla_deploy.gateways.ros.graph import GraphLink

MOST_AT_A_TIME: Final = 8


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


class Pursuit(Protocol):
    """Pursue one goal."""

    def step(self, now_ns: int) -> GoalOutcome | None:
        """Go on; return the outcome once there is one."""
        ...

    def cancel(self, reason: str, *, superseded: bool = False) -> GoalOutcome | None:
        """End it for a reason; None where `step` tells the outcome later.

        One that is superseded leaves what it moves to its successor.
        """
        ...


Feedback = Callable[[Any], None]
Begin = Callable[[Feedback], "Pursuit | GoalOutcome"]
Judge = Callable[[Any], "Begin | GoalOutcome"]
"""Return how to begin with a goal, or how it ended already: it was refused."""


@dataclass(slots=True, kw_only=True, eq=False)
class _Goal:
    handle: ServerGoalHandle
    done: Future
    pursuit: Pursuit
    cancelling: bool = False


class GoalServer:
    """Take the goals of one action; a sound new goal ends the one before it, as usual in ROS."""

    def __init__(self, graph: GraphLink, kind: Any, name: str, judge: Judge) -> None:
        self._graph = graph
        self._kind = kind
        self._judge = judge
        self._goals: list[_Goal] = []
        graph.act(
            ActionServer(
                graph.node,
                kind,
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
        for goal in list(self._goals):
            outcome = goal.pursuit.cancel("the gateway was stopped")
            if outcome is not None:
                self._end(goal, outcome)

    def _admit(self, _request: Any) -> GoalResponse:
        full = len(self._goals) >= MOST_AT_A_TIME
        return GoalResponse.REJECT if full else GoalResponse.ACCEPT

    async def _execute(self, handle: ServerGoalHandle) -> Any:
        done = self._graph.future()
        if not self._graph.put(lambda: self._start(handle, done)):
            handle.abort()
            return self._kind.Result()
        outcome: GoalOutcome = await done
        state = outcome.ending
        # A goal that ends by itself while its cancelling is asked for may end as it did.
        if state is GoalEnding.CANCELED and not handle.is_cancel_requested:
            state = GoalEnding.ABORTED
        getattr(handle, state.value)()
        return outcome.result

    def _start(self, handle: ServerGoalHandle, done: Future) -> None:
        judged = self._judge(handle.request)
        if isinstance(judged, GoalOutcome):
            done.set_result(judged)
            return
        for before in list(self._goals):
            outcome = before.pursuit.cancel("a newer goal took its place", superseded=True)
            if outcome is not None:
                self._end(before, outcome)
        begun = judged(handle.publish_feedback)
        if isinstance(begun, GoalOutcome):
            done.set_result(begun)
            return
        self._goals.append(_Goal(handle=handle, done=done, pursuit=begun))

    def _end(self, goal: _Goal, outcome: GoalOutcome) -> None:
        self._goals.remove(goal)
        goal.done.set_result(outcome)
