"""Serve GripperCommand and ParallelGripperCommand, a server of each for every hand.

A position is the gap between the fingers in m, an effort the force of each finger in N.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, Final, Protocol

from control_msgs.action import GripperCommand, ParallelGripperCommand
from sensor_msgs.msg import JointState

from drivers.clock import NS_PER_S
from vla_deploy.client.motions import Claimed, JointView, Motions
from vla_deploy.client.readiness import refusal_of
from vla_deploy.gateways.ros.inward.pursuing import (
    Begin,
    Feedback,
    GoalEnding,
    GoalOutcome,
    GoalServer,
)
from vla_deploy.gateways.ros.part import Due, Gateway
from vla_deploy.robots import RobotDescription

FEEDBACK_HZ: Final = 10.0
REACHED_M: Final = 0.002
STALLED_S: Final = 0.3
STILL_M_S: Final = 0.002
TIMEOUT_S: Final = 10.0


@dataclass(frozen=True, slots=True, kw_only=True)
class GripperJoint:
    """Describe a hand's fingers: their joint, the gap per joint value, the force of full effort."""

    joint: str
    gap_ratio: float
    most_n: float
    gap_m: tuple[float, float]

    @classmethod
    def of(cls, robot: RobotDescription, hand: str) -> "GripperJoint":
        """Return what the robot file says of a hand."""
        described = robot.hands[hand]
        joint = robot.group(described.gripper).joints[0]
        limits, ratio = robot.limits[joint], described.opening_ratio
        return cls(
            joint=joint,
            gap_ratio=ratio,
            most_n=robot.stall_effort(joint),
            gap_m=(limits.min * ratio, limits.max * ratio),
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class GripperState:
    """Describe how far a hand's fingers are, and whether they rest on something."""

    gap_m: float
    speed_m_s: float
    force_n: float
    reached: bool
    stalled: bool


class _Dialect(Protocol):
    """Read goals and write results of one of the two actions."""

    kind: Any

    def wanted(self, goal: Any) -> tuple[float, float]:
        """Return the wanted gap in m and the most force in N, 0 for the usual.

        Raises:
            ValueError: the goal is malformed.
        """
        ...

    def result(self, state: GripperState | None) -> Any:
        """Return the action's result."""
        ...

    def feedback(self, state: GripperState) -> Any:
        """Return the action's feedback."""
        ...


class _Classic:
    """Speak control_msgs/GripperCommand."""

    kind = GripperCommand

    def wanted(self, goal: Any) -> tuple[float, float]:
        return float(goal.command.position), float(goal.command.max_effort)

    def result(self, state: GripperState | None) -> Any:
        return GripperCommand.Result(**self._told(state))

    def feedback(self, state: GripperState) -> Any:
        return GripperCommand.Feedback(**self._told(state))

    def _told(self, state: GripperState | None) -> dict[str, Any]:
        if state is None:
            return {}
        return {
            "position": state.gap_m,
            "effort": state.force_n,
            "stalled": state.stalled,
            "reached_goal": state.reached,
        }


class _Parallel:
    """Speak control_msgs/ParallelGripperCommand, whose goal names the joint."""

    kind = ParallelGripperCommand

    def __init__(self, joint: str) -> None:
        self._joint = joint

    def wanted(self, goal: Any) -> tuple[float, float]:
        command = goal.command
        if list(command.name) not in ([], [self._joint]) or len(command.position) != 1:
            raise ValueError(f"command: expected one position of {self._joint}")
        if len(command.effort) > 1:
            raise ValueError("command.effort: expected one value or none")
        return float(command.position[0]), float(command.effort[0]) if command.effort else 0.0

    def result(self, state: GripperState | None) -> Any:
        if state is None:
            return ParallelGripperCommand.Result()
        return ParallelGripperCommand.Result(
            state=self._state(state), stalled=state.stalled, reached_goal=state.reached
        )

    def feedback(self, state: GripperState) -> Any:
        return ParallelGripperCommand.Feedback(state=self._state(state))

    def _state(self, state: GripperState) -> JointState:
        return JointState(
            name=[self._joint],
            position=[state.gap_m],
            velocity=[state.speed_m_s],
            effort=[state.force_n],
        )


def gripper_servers(gateway: Gateway, motions: Motions) -> Iterator[GoalServer]:
    """Yield the servers of every hand."""
    for hand, described in gateway.robot.hands.items():
        fingers = GripperJoint.of(gateway.robot, hand)
        for dialect, name in (
            (_Classic(), f"/{described.gripper}_controller/gripper_cmd"),
            (_Parallel(fingers.joint), f"/{described.gripper}_parallel_controller/gripper_cmd"),
        ):
            server = GripperServer(gateway, motions, hand, fingers, dialect)
            yield GoalServer(gateway.graph, dialect.kind, name, server.judge)


class GripperServer:
    """Judge the goals for one hand, and begin those that are sound."""

    def __init__(
        self,
        gateway: Gateway,
        motions: Motions,
        hand: str,
        fingers: GripperJoint,
        dialect: _Dialect,
    ) -> None:
        self._gateway = gateway
        self._motions = motions
        self._fingers = fingers
        self._dialect = dialect
        group = gateway.robot.hands[hand].gripper
        self._claim = Claimed(gateway.link, f"ros/{group}/{dialect.kind.__name__}", (group,))

    def judge(self, goal: Any) -> Begin | GoalOutcome:
        """Return how to begin with a goal, or why not at all."""
        try:
            gap_m, force_n = self._dialect.wanted(goal)
            self._check(gap_m, force_n)
        except ValueError as error:
            return self._refused(str(error))
        why = refusal_of(self._gateway.control_status())
        if why:
            return self._refused(why)
        return lambda feedback: self._begin(gap_m, force_n, feedback)

    def _begin(self, gap_m: float, force_n: float, feedback: Feedback) -> "Gripping | GoalOutcome":
        why = self._claim.why_not_taken()
        if why:
            return self._refused(why)
        fingers = self._fingers
        ratio = min(force_n / fingers.most_n, 1.0) if force_n else 1.0
        joint = fingers.joint
        motion_id = self._motions.go({joint: gap_m / fingers.gap_ratio}, {joint: ratio})
        now_ns = self._gateway.link.clock.now_ns()
        return Gripping(
            self._motions, fingers, self._dialect, self._claim, feedback, motion_id, gap_m, now_ns
        )

    def _check(self, gap_m: float, force_n: float) -> None:
        low, high = self._fingers.gap_m
        if not math.isfinite(gap_m) or not low - 1e-6 <= gap_m <= high + 1e-6:
            raise ValueError(f"position: expected a gap in {low:g}..{high:g} m, got {gap_m}")
        if not math.isfinite(force_n) or force_n < 0.0:
            raise ValueError(f"max_effort: expected 0 or more N, got {force_n}")

    def _refused(self, why: str) -> GoalOutcome:
        self._gateway.graph.node.get_logger().warning(f"{self._fingers.joint}: {why}")
        return GoalOutcome(ending=GoalEnding.ABORTED, result=self._dialect.result(None))


class Gripping:
    """Pursue one goal of a hand until its fingers are there, or rest on something."""

    def __init__(
        self,
        motions: Motions,
        fingers: GripperJoint,
        dialect: _Dialect,
        claim: Claimed,
        feedback: Feedback,
        motion_id: int,
        gap_m: float,
        now_ns: int,
    ) -> None:
        self._motions = motions
        self._fingers = fingers
        self._dialect = dialect
        self._claim = claim
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
            self._feedback(self._dialect.feedback(state))
        return None

    def cancel(self, reason: str, *, superseded: bool = False) -> GoalOutcome | None:
        """End it where the fingers are, or leave them to its successor."""
        if superseded or self._done:
            self._motions.forget(self._motion_id)
            return GoalOutcome(ending=GoalEnding.CANCELED, result=self._dialect.result(None))
        self._ends_as = GoalEnding.CANCELED
        self._motions.cancel(self._motion_id)
        return None

    def _state(self, view: JointView, now_ns: int) -> GripperState:
        fingers = self._fingers
        gap_m = float(view.position[0]) * fingers.gap_ratio
        speed_m_s = float(view.velocity[0]) * fingers.gap_ratio
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
        self._claim.release()
        return GoalOutcome(ending=ending, result=self._dialect.result(state))
