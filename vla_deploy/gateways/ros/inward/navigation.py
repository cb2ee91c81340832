"""Serve NavigateToPose: the pose becomes a plan of one action, judged and driven as any other."""

import math
from typing import Any, Final

from nav2_msgs.action import NavigateToPose
from rclpy.duration import Duration

from vla_deploy.gateways.ros.conversions import fill_pose, yaw_of
from vla_deploy.gateways.ros.geometry import pose_of
from vla_deploy.gateways.ros.inward.action_server import (
    Feedback,
    GoalEnding,
    GoalOutcome,
    GoalRefused,
    require_armed,
)
from vla_deploy.gateways.ros.inward.orders import (
    CommandOrder,
    CommandOrders,
    error_of,
)
from vla_deploy.gateways.ros.part import MAP, ODOM, Due, Gateway
from vla_deploy.ipc import topics
from vla_deploy.ipc.payloads.tasks import ExecutorStatus, TaskEvent
from vla_deploy.robots.floor_pose import ORIGIN, Pose2D
from vla_deploy.robots.kinematics.frame_tree import BASE_FRAME

FAILED: Final = 9000
"""Jazzy's NavigateToPose has no code but NONE; later ones call this UNKNOWN."""
FEEDBACK_HZ: Final = 5.0
MOST_M: Final = 10_000.0
_AGE_S: Final = 0.5


class NavigationAction:
    """Judge poses to drive to, and give sound ones to the planner."""

    kind = NavigateToPose

    def __init__(self, gateway: Gateway, orders: CommandOrders) -> None:
        self._gateway = gateway
        self._orders = orders

    def judge(self, goal: Any) -> Pose2D:
        """Return the pose that a goal names, in the map."""
        if goal.behavior_tree:
            raise GoalRefused(FAILED, "behavior_tree: this robot has none; leave it empty")
        pose = goal.pose.pose
        numbers = (
            *(pose.position.x, pose.position.y, pose.position.z),
            *(pose.orientation.x, pose.orientation.y, pose.orientation.z, pose.orientation.w),
        )
        if not all(math.isfinite(one) and abs(one) < MOST_M for one in numbers):
            raise GoalRefused(FAILED, f"pose: expected finite numbers below {MOST_M:g}")
        if not 0.9 < math.hypot(*numbers[3:]) < 1.1:
            raise GoalRefused(FAILED, "pose.orientation: expected a quaternion of length 1")
        wanted = Pose2D(pose.position.x, pose.position.y, yaw_of(pose.orientation))
        target = self._frame(goal.pose.header.frame_id).compose(wanted)
        require_armed(self._gateway, FAILED)
        return target

    def begin(self, judged: Pose2D, feedback: Feedback) -> "Driving":
        """Give it to the planner."""
        x_m, y_m = judged.x_m, judged.y_m
        action = {
            "id": "navigate",
            "skill": "navigate_to",
            "parameters": {"x_m": x_m, "y_m": y_m, "yaw_rad": judged.yaw_rad},
        }
        plan = {"goal": f"drive to {x_m:.2f}, {y_m:.2f} of the map", "actions": [action]}
        return Driving(self._gateway, self._orders.give(plan=plan), judged, feedback)

    def refused(self, refusal: GoalRefused) -> Any:
        """Return the code and why."""
        return NavigateToPose.Result(error_code=refusal.code, error_msg=str(refusal))

    def _frame(self, frame: str) -> Pose2D:
        """Return where a frame is in the map."""
        if frame in ("", MAP):
            return ORIGIN
        link = self._gateway.link
        pose, base = link.fresh(topics.POSE, _AGE_S), link.fresh(topics.BASE_STATE, _AGE_S)
        if pose is None or base is None:
            words = f"the robot does not know its place now, by which {frame} is known"
            raise GoalRefused(FAILED, words)
        if frame == BASE_FRAME:
            return pose_of(pose)
        if frame == ODOM:
            return pose_of(pose).compose(ORIGIN.relative_to(pose_of(base)))
        raise GoalRefused(
            FAILED, f"pose.header.frame_id: expected {MAP}, {ODOM} or {BASE_FRAME}, got {frame!r}"
        )


class Driving:
    """Pursue one pose."""

    def __init__(
        self, gateway: Gateway, order: CommandOrder, target: Pose2D, feedback: Feedback
    ) -> None:
        self._gateway = gateway
        self._order = order
        self._target = target
        self._feedback = feedback
        self._due = Due(FEEDBACK_HZ)
        self._began_ns = gateway.link.clock.now_ns()
        self._retries = 0
        self._cancelled = ""

    def step(self, now_ns: int) -> GoalOutcome | None:
        """Go on; return the outcome once the command has ended."""
        for event in self._order.news:
            self._note(event)
        self._order.news.clear()
        if self._order.last is not None:
            return self._finish(self._order.last)
        if self._due.is_now(now_ns):
            self._report(now_ns)
        return None

    def cancel(self, reason: str, *, superseded: bool = False) -> GoalOutcome | None:
        """Cancel the command; once the base has come to rest, `step` returns the outcome."""
        self._cancelled = reason
        self._order.cancel()
        return self._given_up(reason) if superseded else None

    def _note(self, event: TaskEvent) -> None:
        if event["event"] == "setback":
            self._retries += 1
        if event["event"] == "action":
            self._retries = max(self._retries, event["retries"])
        if event["event"] == "asked":  # nobody can answer here
            self._cancelled = f"it needs a person's word: {event['question']}"
            self._order.cancel()

    def _finish(self, last: TaskEvent) -> GoalOutcome:
        why = error_of(last)
        if self._cancelled:
            return self._given_up(self._cancelled)
        if why:
            result = NavigateToPose.Result(error_code=FAILED, error_msg=why)
            return GoalOutcome(ending=GoalEnding.ABORTED, result=result)
        return GoalOutcome(ending=GoalEnding.SUCCEEDED, result=NavigateToPose.Result())

    def _given_up(self, reason: str) -> GoalOutcome:
        result = NavigateToPose.Result(error_code=FAILED, error_msg=reason)
        return GoalOutcome(ending=GoalEnding.CANCELED, result=result)

    def _report(self, now_ns: int) -> None:
        link = self._gateway.link
        sample = link.fresh(topics.POSE, _AGE_S)
        if sample is None:
            return
        here = pose_of(sample)
        left_m = self._left_m((here.x_m, here.y_m), link.document(topics.EXECUTOR_STATUS, 1.0))
        seconds = left_m / self._gateway.robot.base.max_speed_m_s
        message = NavigateToPose.Feedback(
            number_of_recoveries=self._retries,
            distance_remaining=left_m,
            estimated_time_remaining=Duration(seconds=seconds).to_msg(),
            navigation_time=Duration(nanoseconds=now_ns - self._began_ns).to_msg(),
        )
        message.current_pose.header.frame_id = MAP
        message.current_pose.header.stamp = self._gateway.time.stamp(sample.stamp_ns)
        fill_pose(message.current_pose.pose, here)
        self._feedback(message)

    def _left_m(self, here: tuple[float, float], executor: ExecutorStatus | None) -> float:
        """Return the length of the way that is left: of the planned one from the nearest point."""
        way = (executor and executor["way_m"]) or [[self._target.x_m, self._target.y_m]]
        nearest = min(range(len(way)), key=lambda i: math.dist(way[i], here))
        rest = way[nearest:]
        return math.dist(here, rest[0]) + sum(map(math.dist, rest, rest[1:]))
