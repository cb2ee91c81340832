"""Turn requests into goals of ROS actions, and what comes back into words."""

from collections.abc import Callable, Mapping
from typing import Any, Final

from action_msgs.msg import GoalStatus
from builtin_interfaces.msg import Duration
from control_msgs.action import FollowJointTrajectory
from nav2_msgs.action import NavigateToPose
from trajectory_msgs.msg import JointTrajectoryPoint

from drivers.clock import NS_PER_S
from vla_deploy.gateways.ros.geometry.rotation import quaternion_of
from vla_deploy.gateways.ros.outward.body import MAP
from vla_deploy.gateways.ros.stamps import RosTime
from vla_deploy.ipc.ros_goals import GoalKind, GoalRequest, GoalState

ACTIONS: Final[Mapping[GoalKind, Any]] = {
    GoalKind.NAVIGATE: NavigateToPose,
    GoalKind.FOLLOW: FollowJointTrajectory,
}
STATES: Final[Mapping[int, GoalState]] = {
    GoalStatus.STATUS_SUCCEEDED: GoalState.SUCCEEDED,
    GoalStatus.STATUS_CANCELED: GoalState.CANCELLED,
    GoalStatus.STATUS_ABORTED: GoalState.ABORTED,
}


def goal_of(request: GoalRequest, time: RosTime) -> Any:
    """Return the goal message of a request."""
    return _BUILDERS[request.kind](request, time)


def state_of(answer: Any) -> tuple[GoalState, str]:
    """Return how a goal ended, and what the server says of it."""
    state = STATES.get(answer.status, GoalState.LOST)
    result = answer.result
    text = str(getattr(result, "error_msg", "") or getattr(result, "error_string", ""))
    code = int(result.error_code)
    if state is GoalState.LOST:
        text = f"the server knows nothing of the goal (status {answer.status}) {text}".strip()
    if state is GoalState.SUCCEEDED and code:
        # joint_trajectory_controller and Nav2 abort then; another server may not.
        return GoalState.ABORTED, f"error code {code}: {text}".rstrip(": ")
    if state is GoalState.ABORTED:
        text = f"error code {code}: {text}".rstrip(": ") if code else text
    return state, text


def left_of(feedback: Any) -> float | None:
    """Return the rest of the way in m, where the feedback tells it."""
    left_m = getattr(feedback, "distance_remaining", None)
    return None if left_m is None else round(float(left_m), 3)


def _navigation(request: GoalRequest, time: RosTime) -> Any:
    assert request.pose is not None  # `read_request` has judged it
    x_m, y_m, yaw_rad = request.pose
    goal = NavigateToPose.Goal()
    goal.pose.header.frame_id = MAP
    goal.pose.header.stamp = time.now()
    goal.pose.pose.position.x, goal.pose.pose.position.y = x_m, y_m
    goal.pose.pose.orientation = quaternion_of(0.0, 0.0, yaw_rad)
    return goal


def _trajectory(request: GoalRequest, _time: RosTime) -> Any:
    # No stamp: it begins when it arrives.
    goal = FollowJointTrajectory.Goal()
    goal.trajectory.joint_names = list(request.joints)
    goal.trajectory.points = [
        JointTrajectoryPoint(positions=list(row), time_from_start=_duration(time_s))
        for time_s, row in zip(request.times_s, request.positions, strict=True)
    ]
    return goal


def _duration(time_s: float) -> Duration:
    seconds, nanoseconds = divmod(round(time_s * NS_PER_S), NS_PER_S)
    return Duration(sec=seconds, nanosec=nanoseconds)


_BUILDERS: Final[Mapping[GoalKind, Callable[[GoalRequest, RosTime], Any]]] = {
    GoalKind.NAVIGATE: _navigation,
    GoalKind.FOLLOW: _trajectory,
}
