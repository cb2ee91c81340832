"""Judge the goal of FollowJointTrajectory before anything moves: codes and words as JTC's."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from control_msgs.action import FollowJointTrajectory
from numpy.typing import NDArray
from rclpy.duration import Duration

from drivers.clock import NS_PER_S
from vla_deploy.gateways.ros.conversions import RosTime
from vla_deploy.gateways.ros.inward.action_server import GoalRefused

Result: Final = FollowJointTrajectory.Result
MOST_POINTS: Final = 255
"""Control follows 256, of which it adds the present place itself."""
MOST_AGE_S: Final = 0.5
MOST_AHEAD_S: Final = 10.0
LONGEST_S: Final = 600.0
GOAL_TOLERANCE: Final = 0.05
"""Where a goal names none, in rad, or in m for a finger: what the arms hold under their weight."""
DEFAULT_GOAL_TIME_S: Final = 0.5
_UNRESTRICTED: Final = -1.0

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class TrajectoryGoal:
    """Hold a sound goal; tolerances are infinite where there is none, in rad or m.

    `start_ns` is when it begins, by the run's clock.
    """

    joints: tuple[str, ...]
    times_s: Floats
    positions: Floats
    start_ns: int
    path_tolerance: Floats
    goal_tolerance: Floats
    goal_time_s: float


def judged_goal(
    goal: Any, joints: Sequence[str], *, partial: bool, time: RosTime
) -> TrajectoryGoal:
    """Return a goal for some joints in the form in which it is pursued.

    Raises:
        GoalRefused: something about it is wrong.
    """
    trajectory = goal.trajectory
    named = _joints(trajectory.joint_names, joints, partial=partial)
    if goal.multi_dof_trajectory.points or goal.multi_dof_trajectory.joint_names:
        raise GoalRefused(Result.INVALID_GOAL, "this robot has no joint of several axes")
    times_s, positions = _points(trajectory.points, len(named))
    return TrajectoryGoal(
        joints=named,
        times_s=times_s,
        positions=positions,
        start_ns=_start_ns(trajectory.header.stamp, float(times_s[-1]), time),
        path_tolerance=_tolerances(goal.path_tolerance, named, math.inf),
        goal_tolerance=_tolerances(goal.goal_tolerance, named, GOAL_TOLERANCE),
        goal_time_s=_seconds(goal.goal_time_tolerance) or DEFAULT_GOAL_TIME_S,
    )


def _joints(named: Sequence[str], known: Sequence[str], *, partial: bool) -> tuple[str, ...]:
    unknown = [name for name in named if name not in known]
    if unknown or not named or len(set(named)) != len(named):
        found = f"{', '.join(unknown[:8])} unknown" if unknown else f"got {list(named)[:8]}"
        raise GoalRefused(
            Result.INVALID_JOINTS, f"joint_names: {found}; expected, each once: {', '.join(known)}"
        )
    if not partial and len(named) != len(known):
        missing = ", ".join(name for name in known if name not in named)
        raise GoalRefused(Result.INVALID_JOINTS, f"joint_names: {missing} missing")
    return tuple(named)


def _points(points: Sequence[Any], width: int) -> tuple[Floats, Floats]:
    if not points:
        raise GoalRefused(Result.INVALID_GOAL, "points: expected at least one, got none")
    if len(points) > MOST_POINTS:
        raise GoalRefused(
            Result.INVALID_GOAL,
            f"points: expected at most {MOST_POINTS}, got {len(points)}; take out some",
        )
    for i, point in enumerate(points):
        for field in ("positions", "velocities", "accelerations", "effort"):
            count = len(getattr(point, field))
            if count != width and (count or field == "positions"):
                raise GoalRefused(
                    Result.INVALID_GOAL,
                    f"points[{i}].{field}: expected {width} values, got {count}",
                )
    times_s = np.array([_seconds(point.time_from_start) for point in points])
    positions = np.array([point.positions for point in points], dtype=np.float64)
    if not np.isfinite(positions).all():
        raise GoalRefused(Result.INVALID_GOAL, "positions: expected finite numbers")
    if times_s[0] < 0.0 or (np.diff(times_s) <= 0.0).any() or times_s[-1] <= 0.0:
        raise GoalRefused(
            Result.INVALID_GOAL, "time_from_start: expected times that rise from point to point"
        )
    if times_s[-1] > LONGEST_S:
        raise GoalRefused(
            Result.INVALID_GOAL, f"time_from_start: expected at most {LONGEST_S:g} s in all"
        )
    return times_s, positions


def _start_ns(stamp: Any, duration_s: float, time: RosTime) -> int:
    now_ns = time.clock.now_ns()
    if time.is_unset(stamp):
        return now_ns
    ahead_s = (time.run_ns(stamp) - now_ns) / NS_PER_S
    if ahead_s < -MOST_AGE_S:
        raise GoalRefused(
            Result.OLD_HEADER_TIMESTAMP,
            f"header.stamp: {-ahead_s:.2f} s ago, expected {MOST_AGE_S} at most, or none for now",
        )
    if ahead_s > MOST_AHEAD_S:
        raise GoalRefused(
            Result.INVALID_GOAL,
            f"header.stamp: {ahead_s:.2f} s ahead, expected {MOST_AHEAD_S:g} at most; "
            "do both go by the same time (use_sim_time)?",
        )
    return max(time.run_ns(stamp), now_ns)


def _tolerances(given: Sequence[Any], joints: Sequence[str], default: float) -> Floats:
    """Return a tolerance per joint: 0 is the default, -1 none (control_msgs/JointTolerance)."""
    by_name: Mapping[str, float] = {one.name: float(one.position) for one in given}
    unknown = [name for name in by_name if name not in joints]
    if unknown:
        raise GoalRefused(
            Result.INVALID_JOINTS, f"tolerance of {', '.join(unknown)}: no joint of the trajectory"
        )
    found = []
    for joint in joints:
        value = by_name.get(joint, 0.0)
        if math.isnan(value) or (value < 0.0 and value != _UNRESTRICTED):
            raise GoalRefused(
                Result.INVALID_GOAL, f"tolerance of {joint}: expected above 0, 0 or -1, got {value}"
            )
        found.append(math.inf if value == _UNRESTRICTED else value or default)
    return np.array(found)


def _seconds(duration: Any) -> float:
    return float(Duration.from_msg(duration).nanoseconds / NS_PER_S)
