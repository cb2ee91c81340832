"""Have servers beyond the robot do a part of a skill: Nav2 drives, others move arms.

Every goal names the claim under which its action holds the parts that the server moves.
"""

import math
from collections.abc import Callable, Generator, Mapping, Sequence
from types import MappingProxyType
from typing import Final

import numpy as np
from numpy.typing import NDArray

from vla_deploy.ipc.ros_goals import MOST_POINTS, GoalKind, GoalRequest, GoalState
from vla_deploy.plans.catalogue import TIMEOUTS_S, SkillKind
from vla_deploy.robots import RobotDescription
from vla_deploy.robots.floor_pose import Pose2D
from vla_deploy.skills.context import BASE, Skill, SkillContext
from vla_deploy.skills.errors import (
    ServerAborted,
    ServerCancelled,
    ServerLost,
    ServerRejected,
    SkillFailed,
)
from vla_deploy.skills.ros_goals import RosGoals, SentGoal

NAVIGATION_SERVER: Final = "navigate_to_pose"
ERRORS: Final[Mapping[GoalState, type[SkillFailed]]] = MappingProxyType(
    {
        GoalState.REJECTED: ServerRejected,
        GoalState.ABORTED: ServerAborted,
        GoalState.CANCELLED: ServerCancelled,
        GoalState.LOST: ServerLost,
    }
)


def server_drives(context: SkillContext) -> bool:
    """Return whether Nav2 drives the base to poses."""
    return context.ros is not None and context.robot.ros.is_driven_by_nav2


def arms_beyond(robot: RobotDescription, joints: Sequence[str]) -> tuple[str, ...]:
    """Return the groups of arms that have some of the joints and are moved by servers."""
    if not robot.ros.are_arms_beyond:
        return ()
    arms = dict.fromkeys(hand.arm for hand in robot.hands.values())
    return tuple(arm for arm in arms if set(robot.group(arm).joints) & set(joints))


def pursue(
    context: SkillContext,
    request: GoalRequest,
    hindrance: Callable[[], str] = lambda: "",
    until: Callable[[], bool] = lambda: False,
) -> Skill:
    """Have one goal pursued to its end; cancel it when `until()` holds, and hold it meanwhile.

    `hindrance()` says what forbids to drive now, "" where nothing does; it may raise, too.

    Raises:
        ServerRejected, ServerAborted, ServerCancelled, ServerLost: it did not succeed.
    """
    ros = _goals_of(context)
    goal = ros.send(context.link.acting, request)
    is_enough = False
    try:
        while not goal.is_final:
            is_enough = is_enough or until()
            if is_enough:
                ros.cancel(goal, "it went far enough")
            else:
                ros.permit(goal, hindrance())
            yield
    finally:
        ros.cancel(goal, "its action has ended")
    if not is_enough or goal.state is GoalState.LOST:
        conclude(goal)


def conclude(goal: SentGoal) -> None:
    """Say how a goal ended.

    Raises:
        ServerRejected, ServerAborted, ServerCancelled, ServerLost: it did not succeed.
    """
    failure = ERRORS.get(goal.state) if goal.state is not None else None
    if failure is None:
        return
    word = f"lost: {goal.text}" if goal.state is GoalState.LOST else goal.text
    raise failure(word or f"the server {goal.request.server}: {goal.state}")


def navigation_request(
    context: SkillContext, target: Pose2D, speed_m_s: float | None
) -> GoalRequest:
    """Return the goal that has Nav2 drive to a pose of the map."""
    return GoalRequest(
        request_id="",
        kind=GoalKind.NAVIGATE,
        server=NAVIGATION_SERVER,
        holder=context.holder,
        parts=(BASE,),
        timeout_s=TIMEOUTS_S[SkillKind.NAVIGATION],
        pose=(float(target.x_m), float(target.y_m), float(target.yaw_rad)),
        most_m_s=speed_m_s or 0.0,
    )


def trajectory_requests(
    context: SkillContext,
    arms: Sequence[str],
    timed: Callable[[Sequence[str]], tuple[NDArray[np.float64], NDArray[np.float64]]],
) -> list[GoalRequest]:
    """Return a goal for each server of some arms; `timed` times the way of some joints.

    The first of the times is the present, which a server knows by itself.
    """
    by_server: dict[str, list[str]] = {}
    for arm in arms:
        by_server.setdefault(context.robot.ros.server_of(arm), []).append(arm)
    requests = []
    for server, parts in by_server.items():
        joints = tuple(joint for part in parts for joint in context.robot.group(part).joints)
        times_s, positions = thinned(*timed(joints))
        requests.append(
            GoalRequest(
                request_id="",
                kind=GoalKind.FOLLOW,
                server=server,
                holder=context.holder,
                parts=tuple(parts),
                timeout_s=TIMEOUTS_S[SkillKind.MANIPULATION],
                joints=joints,
                times_s=tuple(np.round(times_s[1:], 6).tolist()),
                positions=tuple(map(tuple, np.round(positions[1:], 6).tolist())),
            )
        )
    return requests


def thinned(
    times_s: NDArray[np.float64], positions: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return no more points than a request takes, the first and the last among them."""
    step = math.ceil((len(times_s) - 1) / MOST_POINTS) or 1
    kept = np.arange(len(times_s) - 1, -1, -step)[::-1]
    kept = kept if kept[0] == 0 else np.concatenate(([0], kept))
    return times_s[kept], positions[kept]


def pursue_all(
    context: SkillContext, requests: Sequence[GoalRequest]
) -> Generator[None, None, bool]:
    """Have several goals pursued at a time; the first that fails has the others cancelled.

    Returns False where a pause was before the end of one.

    Raises:
        ServerRejected, ServerAborted, ServerCancelled, ServerLost: one did not succeed.
    """
    ros = _goals_of(context)
    goals = [ros.send(context.link.acting, request) for request in requests]
    try:
        while not all(goal.is_final for goal in goals):
            for goal in goals:
                _conclude_unpaused(goal)
            yield
        for goal in goals:
            _conclude_unpaused(goal)
    finally:
        for goal in goals:
            ros.cancel(goal, "its action has ended")
    return not any(goal.is_interrupted for goal in goals)


def _conclude_unpaused(goal: SentGoal) -> None:
    if not (goal.is_interrupted and goal.state is GoalState.CANCELLED):
        conclude(goal)


def _goals_of(context: SkillContext) -> RosGoals:
    if context.ros is None:
        raise ServerAborted(
            "the executor has no way to the ROS gateway; see [ros] of the robot file"
        )
    return context.ros
