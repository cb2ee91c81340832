"""Serve GripperCommand and ParallelGripperCommand, a server of each for every hand.

A position is the gap between the fingers in m, an effort the force of each finger in N.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, Final

from control_msgs.action import GripperCommand, ParallelGripperCommand
from sensor_msgs.msg import JointState

from drivers.clock import NS_PER_S
from vla_deploy.client.motions import Claimed, JointView, Motions
from vla_deploy.gateways.ros.inward.action_server import (
    Feedback,
    GoalEnding,
    GoalOutcome,
    GoalRefused,
    GoalServer,
    require_armed,
)
from vla_deploy.gateways.ros.part import Due, Gateway
from vla_deploy.robots import RobotDescription
from vla_deploy.robots.description import Hand

FEEDBACK_HZ: Final = 10.0
REACHED_M: Final = 0.002
STALLED_S: Final = 0.3
STILL_M_S: Final = 0.002
TIMEOUT_S: Final = 10.0
_NO_CODE: Final = 0
"""Neither action has codes or words in its results: the log has them."""


@dataclass(frozen=True, slots=True, kw_only=True)
class GripperJoint:
    """Describe a hand's fingers: their joint, how it makes a gap, the force of full effort."""

    group: str
    joint: str
    hand: Hand
    most_n: float
    gap_m: tuple[float, float]

    @classmethod
    def of(cls, robot: RobotDescription, hand: str) -> "GripperJoint":
        """Return what the robot file says of a hand."""
        described = robot.hands[hand]
        joint = robot.gripper_joint(hand)
        limits = robot.limits[joint]
        return cls(
            group=described.gripper,
            joint=joint,
            hand=described,
            most_n=robot.stall_effort(joint),
            gap_m=(described.opening_m(limits.min), described.opening_m(limits.max)),
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class GripperState:
    """Describe how far a hand's fingers are, and whether they rest on something."""

    gap_m: float
    speed_m_s: float
    force_n: float
    reached: bool
    stalled: bool


def gripper_servers(gateway: Gateway, motions: Motions) -> Iterator[GoalServer]:
    """Yield the servers of every hand."""
    for hand, described in gateway.robot.hands.items():
        fingers = GripperJoint.of(gateway.robot, hand)
        for action, name in (
            (GripperAction(gateway, motions, fingers), "controller"),
            (ParallelGripperAction(gateway, motions, fingers), "parallel_controller"),
        ):
            yield GoalServer(gateway, f"/{described.gripper}_{name}/gripper_cmd", action)


class GripperAction:
    """Judge the goals of GripperCommand for one hand, and begin those that are sound."""

    kind: Any = GripperCommand

    def __init__(self, gateway: Gateway, motions: Motions, fingers: GripperJoint) -> None:
        self.motions: Final = motions
        self.fingers: Final = fingers
        self._gateway = gateway
        holder = f"ros/{fingers.group}/{self.kind.__name__}"
        self.claim: Final = Claimed(gateway.link, holder, (fingers.group,))

    def judge(self, goal: Any) -> tuple[float, float]:
        """Return the wanted gap in m and the most force in N, 0 for the usual."""
        gap_m, force_n = self._wanted(goal.command)
        low, high = self.fingers.gap_m
        if not math.isfinite(gap_m) or not low - 1e-6 <= gap_m <= high + 1e-6:
            words = f"position: expected a gap in {low:g}..{high:g} m, got {gap_m}"
            raise GoalRefused(_NO_CODE, words)
        if not math.isfinite(force_n) or force_n < 0.0:
            raise GoalRefused(_NO_CODE, f"max_effort: expected 0 or more N, got {force_n}")
        require_armed(self._gateway, _NO_CODE)
        return gap_m, force_n

    def begin(self, judged: tuple[float, float], feedback: Feedback) -> "Gripping":
        """Take the hand and begin."""
        gap_m, force_n = judged
        why = self.claim.why_not_taken()
        if why:
            raise GoalRefused(_NO_CODE, why)
        fingers = self.fingers
        ratio = min(force_n / fingers.most_n, 1.0) if force_n else 1.0
        motion_id = self.motions.go(
            {fingers.joint: fingers.hand.position_at(gap_m)}, {fingers.joint: ratio}
        )
        return Gripping(self, feedback, motion_id, gap_m, self._gateway.link.clock.now_ns())

    def refused(self, refusal: GoalRefused) -> Any:
        """Log why, and return a result that says nothing."""
        self._gateway.graph.node.get_logger().warning(f"{self.fingers.joint}: {refusal}")
        return self.kind.Result()

    def result(self, state: GripperState) -> Any:
        """Return the action's result."""
        return self.kind.Result(**self._fields(state), **self._ends(state))

    def feedback(self, state: GripperState) -> Any:
        """Return the action's feedback, which says whether it ends, too."""
        return self.kind.Feedback(**self._fields(state), **self._ends(state))

    def _wanted(self, command: Any) -> tuple[float, float]:
        return float(command.position), float(command.max_effort)

    def _fields(self, state: GripperState) -> dict[str, Any]:
        return {"position": state.gap_m, "effort": state.force_n}

    def _ends(self, state: GripperState) -> dict[str, Any]:
        return {"stalled": state.stalled, "reached_goal": state.reached}


class ParallelGripperAction(GripperAction):
    """Do the same for ParallelGripperCommand, whose goal names the joint."""

    kind: Any = ParallelGripperCommand

    def feedback(self, state: GripperState) -> Any:
        """Return the action's feedback."""
        return self.kind.Feedback(**self._fields(state))

    def _wanted(self, command: Any) -> tuple[float, float]:
        if list(command.name) not in ([], [self.fingers.joint]) or len(command.position) != 1:
            words = f"command: expected one position of {self.fingers.joint}"
            raise GoalRefused(_NO_CODE, words)
        if len(command.effort) > 1:
            raise GoalRefused(_NO_CODE, "command.effort: expected one value or none")
        return float(command.position[0]), float(command.effort[0]) if command.effort else 0.0

    def _fields(self, state: GripperState) -> dict[str, Any]:
        joint_state = JointState(
            name=[self.fingers.joint],
            position=[state.gap_m],
            velocity=[state.speed_m_s],
            effort=[state.force_n],
        )
        return {"state": joint_state}


class Gripping:
    """Pursue one goal of a hand until its fingers are there, or rest on something."""

    def __init__(
        self, action: GripperAction, feedback: Feedback, motion_id: int, gap_m: float, now_ns: int
    ) -> None:
        self._action = action
        self._motions = action.motions
        self._fingers = action.fingers
        self._feedback = feedback
        self._motion_id = motion_id
        self._gap_m = gap_m
        self._due = Due(FEEDBACK_HZ)
        self._done = False
        self._still_since_ns: int | None = None
        self._end_by_ns = now_ns + round(TIMEOUT_S * NS_PER_S)
        self._ends_as: GoalEnding | None = None

    def step(self, now_ns: int) -> GoalOutcome | None:
        """Go on; fingers that meet something before their goal have stalled, which is success."""
        view = self._motions.look((self._fingers.joint,))
        ended = self._motions.ended(self._motion_id)
        state = None if view is None else self._state(view, now_ns)
        if ended is not None:
            self._done = ended.status in ("done", "touched")
            if self._ends_as is not None or not self._done:
                return self._finish(self._ends_as or GoalEnding.ABORTED, state)
        if state is None:
            return None
        if self._done and (state.reached or state.stalled):
            return self._finish(GoalEnding.SUCCEEDED, state)
        if now_ns > self._end_by_ns:
            self._motions.cancel(self._motion_id)
            return self._finish(GoalEnding.ABORTED, state)
        if self._due.is_now(now_ns):
            self._feedback(self._action.feedback(state))
        return None

    def cancel(self, reason: str, *, superseded: bool = False) -> GoalOutcome | None:
        """End it where the fingers are, or leave them to its successor."""
        if superseded:
            self._motions.forget(self._motion_id)
            return GoalOutcome(ending=GoalEnding.CANCELED, result=self._action.kind.Result())
        if self._done:
            return self._finish(GoalEnding.CANCELED, None)
        self._ends_as = GoalEnding.CANCELED
        self._motions.cancel(self._motion_id)
        return None

    def _state(self, view: JointView, now_ns: int) -> GripperState:
        fingers = self._fingers
        gap_m = fingers.hand.opening_m(float(view.position[0]))
        speed_m_s = float(view.velocity[0]) * fingers.hand.opening_ratio
        if abs(speed_m_s) > STILL_M_S:
            self._still_since_ns = None
        elif self._still_since_ns is None:
            self._still_since_ns = now_ns
        reached = abs(gap_m - self._gap_m) <= REACHED_M
        since_ns = self._still_since_ns
        still = since_ns is not None and now_ns - since_ns > STALLED_S * NS_PER_S
        return GripperState(
            gap_m=gap_m,
            speed_m_s=speed_m_s,
            force_n=float(view.effort_ratio[0]) * fingers.most_n,
            reached=reached,
            stalled=self._done and still and not reached,
        )

    def _finish(self, ending: GoalEnding, state: GripperState | None) -> GoalOutcome:
        self._action.claim.release()
        kind = self._action.kind
        result = kind.Result() if state is None else self._action.result(state)
        return GoalOutcome(ending=ending, result=result)
