"""Serve FollowJointTrajectory as joint_trajectory_controller does, one server for each group."""

from collections.abc import Callable, Sequence
from typing import Any, Final

import numpy as np
from control_msgs.action import FollowJointTrajectory
from trajectory_msgs.msg import JointTrajectoryPoint

from drivers.clock import NS_PER_S
from vla_deploy.client.motions import Claimed, Ended, JointView, Motions
from vla_deploy.gateways.ros.inward.action_server import (
    Feedback,
    GoalEnding,
    GoalOutcome,
    GoalRefused,
    require_armed,
)
from vla_deploy.gateways.ros.inward.trajectory_goal import Result, TrajectoryGoal, judged_goal
from vla_deploy.gateways.ros.outgoing.lending import Borrowed
from vla_deploy.gateways.ros.part import Due, Gateway
from vla_deploy.ipc.errors import BadPayload

FEEDBACK_HZ: Final = 20.0


class TrajectoryAction:
    """Judge the goals for some joints, and begin those that are sound."""

    kind = FollowJointTrajectory

    def __init__(
        self,
        gateway: Gateway,
        motions: Motions,
        joints: Sequence[str],
        hold: Callable[[Sequence[str]], Claimed | Borrowed],
        *,
        partial: bool = False,
    ) -> None:
        """Serve some joints, with `partial` any of them; `hold` makes what holds their groups."""
        self._gateway = gateway
        self._motions = motions
        self._joints = tuple(joints)
        self._partial = partial
        self._hold = hold
        self._claim: Claimed | Borrowed | None = None

    def judge(self, goal: Any) -> TrajectoryGoal:
        """Return the goal in the form in which it is pursued."""
        judged = judged_goal(goal, self._joints, partial=self._partial, time=self._gateway.time)
        require_armed(self._gateway, Result.INVALID_GOAL)
        return judged

    def begin(self, judged: TrajectoryGoal, feedback: Feedback) -> "TrajectoryPursuit":
        """Take the joints' groups and begin."""
        if self._claim is not None:
            self._claim.release()
        self._claim = self._hold(self._gateway.robot.groups_moving(judged.joints))
        why = self._claim.why_not_taken()
        if why:
            raise GoalRefused(Result.INVALID_GOAL, why)
        return TrajectoryPursuit(self._gateway, self._motions, judged, feedback, self._claim)

    def refused(self, refusal: GoalRefused) -> Any:
        """Return the code and why."""
        return Result(error_code=refusal.code, error_string=str(refusal))


class TrajectoryPursuit:
    """Pursue one trajectory: wait for its start, watch its tolerances, settle at its end."""

    def __init__(
        self,
        gateway: Gateway,
        motions: Motions,
        goal: TrajectoryGoal,
        feedback: Feedback,
        claim: Claimed | Borrowed,
    ) -> None:
        self._gateway = gateway
        self._motions = motions
        self._goal = goal
        self._feedback = feedback
        self._claim = claim
        self._due = Due(FEEDBACK_HZ)
        self._motion_id: int | None = None
        self._settle_by_ns: int | None = None
        self._ends_as: tuple[GoalEnding, int, str] | None = None

    def step(self, now_ns: int) -> GoalOutcome | None:
        """Go on; return the outcome once there is one."""
        view = self._motions.look(self._goal.joints)
        if self._motion_id is None:
            return None if view is None else self._start(view, now_ns)
        ended = self._motions.ended(self._motion_id)
        if ended is not None and (self._ends_as is not None or ended.status != "done"):
            return self._finish(*self._ending_of(ended))
        self._end_with_claim()
        if view is None:
            return None
        if ended is not None:
            self._settle_by_ns = now_ns + round(self._goal.goal_time_s * NS_PER_S)
        if self._settle_by_ns is not None:
            return self._settle(view, now_ns)
        if self._due.is_now(now_ns):
            self._feedback(self._message(view))
        self._watch(view)
        return None

    def cancel(self, reason: str, *, superseded: bool = False) -> GoalOutcome | None:
        """End it; control ramps its joints to rest, or its successor takes them over."""
        code = Result.INVALID_GOAL if superseded else Result.SUCCESSFUL
        if superseded and self._motion_id is not None:
            self._motions.forget(self._motion_id)
        if superseded or self._motion_id is None or self._settle_by_ns is not None:
            return self._finish(GoalEnding.CANCELED, code, reason, keep_claim=superseded)
        self._end_as(GoalEnding.CANCELED, code, reason)
        return None

    def _start(self, view: JointView, now_ns: int) -> GoalOutcome | None:
        goal = self._goal
        if now_ns < goal.start_ns:
            return None
        times_s, positions = goal.times_s, goal.positions
        if times_s[0] > 0.0:  # control wants the way from where the joints are held
            times_s = np.concatenate([[0.0], times_s])
            positions = np.concatenate([view.setpoint[None], positions])
        try:
            self._motion_id = self._motions.follow(goal.joints, times_s, positions)
        except BadPayload as error:
            return self._finish(GoalEnding.ABORTED, Result.INVALID_GOAL, f"too long: {error}")
        return None

    def _end_with_claim(self) -> None:
        """End a motion whose joints may be moved no longer."""
        why = self._claim.why_over() if self._ends_as is None else ""
        if why and self._settle_by_ns is None:
            self._end_as(GoalEnding.ABORTED, Result.INVALID_GOAL, why)

    def _watch(self, view: JointView) -> None:
        """End a motion that has left its path; it has ended when the joints rest."""
        error = np.abs(view.setpoint - view.position)
        if self._ends_as is None and (error > self._goal.path_tolerance).any():
            text = self._exceeded(error, self._goal.path_tolerance, "off its path")
            self._end_as(GoalEnding.ABORTED, Result.PATH_TOLERANCE_VIOLATED, text)

    def _end_as(self, ending: GoalEnding, code: int, text: str) -> None:
        """Have control end the motion; `step` returns this outcome when its joints rest."""
        self._ends_as = ending, code, text
        self._motions.cancel(self._motion_id or 0)

    def _settle(self, view: JointView, now_ns: int) -> GoalOutcome | None:
        error = np.abs(self._goal.positions[-1] - view.position)
        if (error <= self._goal.goal_tolerance).all():
            return self._finish(GoalEnding.SUCCEEDED, Result.SUCCESSFUL, "")
        if now_ns < (self._settle_by_ns or 0):
            return None
        text = self._exceeded(error, self._goal.goal_tolerance, "off its goal")
        return self._finish(GoalEnding.ABORTED, Result.GOAL_TOLERANCE_VIOLATED, text)

    def _ending_of(self, ended: Ended) -> tuple[GoalEnding, int, str]:
        if self._ends_as is not None:
            return self._ends_as
        text = f"{ended.status}: {ended.reason}" if ended.reason else ended.status
        refused = ended.status == "refused"
        code = Result.INVALID_GOAL if refused else Result.PATH_TOLERANCE_VIOLATED
        return GoalEnding.ABORTED, code, text

    def _finish(
        self, ending: GoalEnding, code: int, text: str, *, keep_claim: bool = False
    ) -> GoalOutcome:
        if not keep_claim:
            self._claim.release()
        result = Result(error_code=code, error_string=text)
        return GoalOutcome(ending=ending, result=result)

    def _exceeded(self, error: Any, tolerance: Any, what: str) -> str:
        worst = int(np.argmax(error - tolerance))
        joint = self._goal.joints[worst]
        return f"{joint} is {error[worst]:.4f} {what}, tolerance {tolerance[worst]:.4f}"

    def _message(self, view: JointView) -> Any:
        message = FollowJointTrajectory.Feedback(joint_names=list(self._goal.joints))
        message.header.stamp = self._gateway.time.stamp(view.stamp_ns)
        message.desired = JointTrajectoryPoint(positions=view.setpoint.tolist())
        message.actual = JointTrajectoryPoint(
            positions=view.position.tolist(), velocities=view.velocity.tolist()
        )
        message.error = JointTrajectoryPoint(positions=(view.setpoint - view.position).tolist())
        return message
