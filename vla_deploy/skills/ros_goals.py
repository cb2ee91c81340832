"""Hold the executor's end of goals that servers beyond the robot pursue, through the ROS gateway.

The gateway tells how each goal stands. One that falls silent, or is started again, has lost them.
"""

import itertools
import os
from dataclasses import dataclass, replace
from typing import Final

from drivers.clock import NS_PER_S, Clock
from vla_deploy.ipc import Sample, SharedSpace, topics
from vla_deploy.ipc.payloads.services import RosStatus
from vla_deploy.ipc.ros_goals import (
    GoalAct,
    GoalAnswer,
    GoalKind,
    GoalRequest,
    GoalState,
    RosGoalUnreadable,
    read_answer,
)

GATEWAY_AGE_S: Final = 2.0
"""It tells its status twice a second."""
GATEWAY_WAIT_S: Final = 5.0
_PERMIT_NS: Final = NS_PER_S // 10
_SILENT: Final = "the ROS gateway has been silent for {:g} s; see: vla-deploy status"
_ABSENT: Final = "the ROS gateway does not run; see: vla-deploy status"


@dataclass(slots=True, kw_only=True, eq=False)
class SentGoal:
    """Hold how one goal stands; `state` is None until the gateway has told any.

    `note` is what the server said to a cancel. `left_m` is the rest of the way, where it is told.
    What a pause interrupts goes on afterwards.
    """

    request: GoalRequest
    actor: str
    state: GoalState | None = None
    text: str = ""
    note: str = ""
    left_m: float | None = None
    asked_ns: int = 0
    gateway_pid: int = 0
    is_cancelled: bool = False
    is_interrupted: bool = False
    permit_ns: int = 0
    is_held: bool = False

    @property
    def is_final(self) -> bool:
        """Return whether nothing more comes."""
        return self.state is not None and self.state.is_final


class RosGoals:
    """Send goals, watch them, have them cancelled; nothing here waits."""

    def __init__(self, space: SharedSpace, clock: Clock) -> None:
        self._clock = clock
        self._requests = space.ring_writer(topics.ROS_REQUEST)
        self._answers = space.ring_reader(topics.ROS_ANSWER, from_start=False)
        self._status = space.cell_reader(topics.ROS_STATUS)
        self._numbers = itertools.count(1)
        self._goals: dict[str, SentGoal] = {}
        self._words: dict[str, str] = {}

    def refresh(self) -> None:
        """Take in what the gateway tells, and find out whether it still has the goals."""
        for event in self._answers.drain():
            try:
                self._note(read_answer(event.payload))
            except RosGoalUnreadable as error:  # of a gateway that has other words than we
                self._lose_all(str(error))
        sample = self._status.latest()
        for goal in list(self._goals.values()):
            self._watch(goal, sample)
        for request_id, goal in list(self._goals.items()):
            if goal.is_final:
                del self._goals[request_id]
                self._keep_words(goal)

    def words_of(self, actor: str) -> str:
        """Return, once, what servers said to an action's cancels where that was no plain yes."""
        return self._words.pop(actor, "")

    def send(self, actor: str, request: GoalRequest) -> SentGoal:
        """Begin with a goal for an action; `request_id` is given to it here."""
        request_id = f"{os.getpid()}-{next(self._numbers)}"
        goal = SentGoal(
            request=replace(request, request_id=request_id),
            actor=actor,
            asked_ns=self._clock.now_ns(),
        )
        self._goals[request_id] = goal
        self._watch(goal, self._status.latest())
        return goal

    def permit(self, goal: SentGoal, hindrance: str = "") -> None:
        """Give a goal leave to drive for a moment, or hold it while something hinders it."""
        now_ns, is_held = self._clock.now_ns(), bool(hindrance)
        if goal.is_final or not goal.gateway_pid:
            return
        if is_held == goal.is_held and now_ns - goal.permit_ns < _PERMIT_NS:
            return
        goal.permit_ns, goal.is_held = now_ns, is_held
        self._ask(goal, GoalAct.HOLD if is_held else GoalAct.PERMIT)

    def cancel(self, goal: SentGoal, reason: str) -> None:
        """Have a goal cancelled; it ends when its server has ended it, or cannot be reached."""
        if goal.is_final or goal.is_cancelled:
            return
        goal.is_cancelled = True
        if goal.gateway_pid:
            self._ask(goal, GoalAct.CANCEL, reason)
        else:
            _end(goal, GoalState.CANCELLED, "it was not sent yet")

    def pause(self) -> None:
        """Have arms stop on their way; a base that nobody permits to drive stops by itself."""
        for goal in self._goals.values():
            if goal.request.kind is GoalKind.FOLLOW and not goal.is_final:
                goal.is_interrupted = True
                self.cancel(goal, "paused")

    def cancel_of(self, actor: str, reason: str) -> None:
        """Have every goal of an action cancelled."""
        for goal in self._goals.values():
            if goal.actor == actor:
                self.cancel(goal, reason)

    def is_ending(self, actor: str) -> bool:
        """Return whether a goal of an action is still being cancelled."""
        return any(goal.actor == actor and not goal.is_final for goal in self._goals.values())

    def close(self) -> None:
        """Have every goal cancelled, and let go of the topics."""
        for goal in self._goals.values():
            self.cancel(goal, "the executor was stopped")
        self._requests.close()
        self._answers.close()
        self._status.close()

    def _note(self, answer: GoalAnswer) -> None:
        goal = self._goals.get(answer.request_id)
        if goal is None or goal.is_final:
            return
        if answer.state is GoalState.CANCEL_REJECTED:
            goal.note = answer.text
        if answer.left_m is not None:
            goal.left_m = answer.left_m
        if answer.state.is_final:
            _end(goal, answer.state, answer.text)
        else:
            goal.state = answer.state

    def _keep_words(self, goal: SentGoal) -> None:
        if goal.is_cancelled and goal.state is not GoalState.CANCELLED:
            said = "; ".join(one for one in (goal.note, goal.text) if one)
            self._words[goal.actor] = f"{goal.request.server} after its cancel: {goal.state}" + (
                f": {said}" if said else ""
            )

    def _watch(self, goal: SentGoal, sample: Sample[RosStatus] | None) -> None:
        """Send a goal as soon as the gateway is there, and lose it where the gateway is not."""
        now_ns = self._clock.now_ns()
        is_young = sample is not None and sample.age_s(now_ns) <= GATEWAY_AGE_S
        if goal.is_final:
            return
        if goal.gateway_pid:
            if not is_young:
                _end(goal, GoalState.LOST, _SILENT.format(GATEWAY_AGE_S))
            elif sample is not None and sample.writer_pid != goal.gateway_pid:
                why = "the ROS gateway ended while it had the goal, and was started again"
                _end(goal, GoalState.LOST, why)
        elif is_young and sample is not None:
            goal.gateway_pid = sample.writer_pid
            self._requests.publish(goal.request.document())
        elif now_ns - goal.asked_ns > round(GATEWAY_WAIT_S * NS_PER_S):
            _end(goal, GoalState.ABORTED, _ABSENT)

    def _lose_all(self, why: str) -> None:
        for goal in self._goals.values():
            _end(goal, GoalState.LOST, why)

    def _ask(self, goal: SentGoal, act: GoalAct, reason: str = "") -> None:
        request_id = goal.request.request_id
        self._requests.publish({"act": act.value, "request_id": request_id, "reason": reason})


def _end(goal: SentGoal, state: GoalState, text: str) -> None:
    goal.state, goal.text = state, text
