"""Turn requests into goals of ROS actions, and what comes back into words."""

from collections.abc import Mapping
from typing import Any, Final

from action_msgs.msg import GoalStatus
from control_msgs.action import FollowJointTrajectory
from nav2_msgs.action import NavigateToPose
from rclpy.duration import Duration
from trajectory_msgs.msg import JointTrajectoryPoint

from drivers.clock import NS_PER_S
from vla_deploy.gateways.ros.conversions import RosTime, fill_pose
from vla_deploy.gateways.ros.part import MAP
from vla_deploy.ipc.ros_goals import GoalKind, GoalRequest, GoalState
from vla_deploy.robots.floor_pose import Pose2D

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
    if request.kind is GoalKind.NAVIGATE:
        assert request.pose is not None  # `read_request` has judged it
        goal = NavigateToPose.Goal()
        goal.pose.header.frame_id = MAP
        goal.pose.header.stamp = time.now()
        fill_pose(goal.pose.pose, Pose2D(*request.pose))
        return goal
    goal = FollowJointTrajectory.Goal()  # no stamp: it begins when it arrives
    goal.trajectory.joint_names = list(request.joints)
    for time_s, row in zip(request.times_s, request.positions, strict=True):
        since_start = Duration(nanoseconds=round(time_s * NS_PER_S)).to_msg()
        point = JointTrajectoryPoint(positions=list(row), time_from_start=since_start)
        goal.trajectory.points.append(point)
    return goal


def state_of(answer: Any) -> tuple[GoalState, str]:
    """Return how a goal ended, and what the server says of it."""
    state = STATES.get(answer.status, GoalState.LOST)
    result = answer.result
    text = str(getattr(result, "error_msg", "") or getattr(result, "error_string", ""))
    code = int(result.error_code)
    if state is GoalState.LOST:
        return (
            state,
            f"the server knows nothing of the goal (status {answer.status}) {text}".strip(),
        )
    if code and state is not GoalState.CANCELLED:
        # joint_trajectory_controller and Nav2 abort then; another server may say it succeeded.
        return GoalState.ABORTED, f"error code {code}: {text}".rstrip(": ")
    return state, text


def left_of(feedback: Any) -> float | None:
    """Return the rest of the way in m, where the feedback has it."""
    left_m = getattr(feedback, "distance_remaining", None)
    return None if left_m is None else round(float(left_m), 3)
