"""Serve NavigateToPose: the pose becomes a plan of one action, judged and driven as any other."""

import math
from typing import Any, Final

from builtin_interfaces.msg import Duration
from geometry_msgs.msg import PoseStamped
from nav2_msgs.action import NavigateToPose

from drivers.clock import NS_PER_S
from vla_deploy.client.readiness import refusal_of
from vla_deploy.gateways.ros.geometry.planar import Planar, inverse, joined, planar_of
from vla_deploy.gateways.ros.geometry.rotation import quaternion_of, yaw_of
from vla_deploy.gateways.ros.inward.orders import (
    CommandOrder,
    CommandOrders,
    OrderInvalid,
    error_of,
)
from vla_deploy.gateways.ros.inward.pursuing import Begin, Feedback, GoalEnding, GoalOutcome
from vla_deploy.gateways.ros.outward.body import MAP, ODOM
from vla_deploy.gateways.ros.part import Due, Gateway
from vla_deploy.ipc import topics
from vla_deploy.ipc.payloads.tasks import ExecutorStatus, TaskEvent
from vla_deploy.robots.kinematics.frame_tree import BASE_FRAME

FAILED: Final = 9000
"""Jazzy's NavigateToPose has no code but NONE; later ones call this UNKNOWN."""
FEEDBACK_HZ: Final = 5.0
MOST_M: Final = 10_000.0
_AGE_S: Final = 0.5


def _failed(text: str) -> GoalOutcome:
    result = NavigateToPose.Result(error_code=FAILED, error_msg=text)
    return GoalOutcome(ending=GoalEnding.ABORTED, result=result)


class NavigationServer:
    """Judge poses to drive to, and give sound ones to the planner."""

    def __init__(self, gateway: Gateway, orders: CommandOrders) -> None:
        self._gateway = gateway
        self._orders = orders

    def judge(self, goal: Any) -> Begin | GoalOutcome:
        """Return how to begin with a goal, or why not at all."""
        try:
            target = self._target(goal)
        except OrderInvalid as error:
            return _failed(str(error))
        why = refusal_of(self._gateway.control_status())
        if why:
            return _failed(why)
        return lambda feedback: self._begin(target, feedback)

    def _begin(self, target: Planar, feedback: Feedback) -> "Driving | GoalOutcome":
        x_m, y_m, yaw_rad = target
        action = {
            "id": "navigate",
            "skill": "navigate_to",
            "parameters": {"x_m": x_m, "y_m": y_m, "yaw_rad": yaw_rad},
        }
        plan = {"goal": f"drive to {x_m:.2f}, {y_m:.2f} of the map", "actions": [action]}
        return Driving(self._gateway, self._orders.give(plan=plan), target, feedback)

    def _target(self, goal: Any) -> Planar:
        if goal.behavior_tree:
            raise OrderInvalid("behavior_tree: this robot has none; leave it empty")
        pose, frame = goal.pose.pose, goal.pose.header.frame_id
        numbers = (
            *(pose.position.x, pose.position.y, pose.position.z),
            *(pose.orientation.x, pose.orientation.y, pose.orientation.z, pose.orientation.w),
        )
        if not all(math.isfinite(one) and abs(one) < MOST_M for one in numbers):
            raise OrderInvalid(f"pose: expected finite numbers below {MOST_M:g}")
        if not 0.9 < math.hypot(*numbers[3:]) < 1.1:
            raise OrderInvalid("pose.orientation: expected a quaternion of length 1")
        wanted = (pose.position.x, pose.position.y, yaw_of(pose.orientation))
        if frame in ("", MAP):
            return wanted
        return joined(self._frame(frame), wanted)

    def _frame(self, frame: str) -> Planar:
        link = self._gateway.link
        pose, base = link.fresh(topics.POSE, _AGE_S), link.fresh(topics.BASE_STATE, _AGE_S)
        if pose is None or base is None:
            raise OrderInvalid(f"the robot does not know its place now, by which {frame} is known")
        if frame == BASE_FRAME:
            return planar_of(pose)
        if frame == ODOM:
            return joined(planar_of(pose), inverse(planar_of(base)))
        raise OrderInvalid(
            f"pose.header.frame_id: expected {MAP}, {ODOM} or {BASE_FRAME}, got {frame!r}"
        )


class Driving:
    """Pursue one pose."""

    def __init__(
        self, gateway: Gateway, order: CommandOrder, target: Planar, feedback: Feedback
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
            self._tell(now_ns)
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
        if not why and not self._cancelled:
            return GoalOutcome(ending=GoalEnding.SUCCEEDED, result=NavigateToPose.Result())
        return self._given_up(self._cancelled) if self._cancelled else _failed(why)

    def _given_up(self, reason: str) -> GoalOutcome:
        result = NavigateToPose.Result(error_code=FAILED, error_msg=reason)
        return GoalOutcome(ending=GoalEnding.CANCELED, result=result)

    def _tell(self, now_ns: int) -> None:
        link = self._gateway.link
        sample = link.fresh(topics.POSE, _AGE_S)
        if sample is None:
            return
        x_m, y_m, yaw_rad = planar_of(sample)
        message = NavigateToPose.Feedback(
            current_pose=PoseStamped(), number_of_recoveries=self._retries
        )
        message.current_pose.header.frame_id = MAP
        message.current_pose.header.stamp = self._gateway.time.stamp(sample.stamp_ns)
        position = message.current_pose.pose.position
        position.x, position.y = x_m, y_m
        message.current_pose.pose.orientation = quaternion_of(0.0, 0.0, yaw_rad)
        left_m = self._left_m((x_m, y_m), link.document(topics.EXECUTOR_STATUS, 1.0))
        message.distance_remaining = left_m
        seconds = left_m / self._gateway.robot.base.max_speed_m_s
        message.estimated_time_remaining = _duration(seconds)
        message.navigation_time = _duration((now_ns - self._began_ns) / NS_PER_S)
        self._feedback(message)

    def _left_m(self, here: tuple[float, float], executor: ExecutorStatus | None) -> float:
        """Return the length of the way that is left: of the planned one from the nearest point."""
        way = (executor and executor["way_m"]) or [[*self._target[:2]]]
        nearest = min(range(len(way)), key=lambda i: math.dist(way[i], here))
        rest = way[nearest:]
        return math.dist(here, rest[0]) + sum(map(math.dist, rest, rest[1:]))


def _duration(seconds: float) -> Duration:
    whole = int(seconds)
    return Duration(sec=whole, nanosec=int((seconds - whole) * NS_PER_S))
