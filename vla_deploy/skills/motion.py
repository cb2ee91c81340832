"""Move joints and wait for them: the pieces that every bodily skill is made of."""

import math
from collections.abc import Callable, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from drivers.clock import NS_PER_S
from vla_deploy.skills.context import Skill, SkillContext
from vla_deploy.skills.errors import RobotNotReady, TryAgain

SETTLED_RAD_S = 0.03
SETTLE_TIMEOUT_S = 1.5


def pause(context: SkillContext, duration_s: float) -> Skill:
    """Wait for a while."""
    end_ns = context.link.clock.now_ns() + round(duration_s * NS_PER_S)
    while context.link.clock.now_ns() < end_ns:
        yield


def wait_until(context: SkillContext, done: Callable[[], bool], timeout_s: float) -> Skill:
    """Wait until `done()` or the time-out; the caller checks which it was."""
    end_ns = context.link.clock.now_ns() + round(timeout_s * NS_PER_S)
    while not done() and context.link.clock.now_ns() < end_ns:
        yield


def _finish(context: SkillContext, motion_id: int, what: str) -> Skill:
    while (result := context.link.ended(motion_id)) is None:
        yield
    if result.status == "stopped":
        raise RobotNotReady(f"{what}: stopped by control: {result.reason}")
    if result.status != "done":
        raise TryAgain(f"{what}: {result.status}: {result.reason}")


def move_joints(
    context: SkillContext,
    targets: Mapping[str, float],
    speed_ratio: float = 1.0,
    effort_ratio: Mapping[str, float] | None = None,
) -> Skill:
    """Bring joints to targets, all arriving together.

    Raises:
        TryAgain: control refused or cancelled the motion.
        RobotNotReady: a stop ended it.
    """
    motion_id = context.link.send_goal(targets, speed_ratio, effort_ratio)
    yield from _finish(context, motion_id, f"moving {_named(targets)}")


def follow_joints(
    context: SkillContext, joints: Sequence[str], waypoints: NDArray[np.float64], speed_ratio: float
) -> Skill:
    """Move through joint waypoints (n, joints) from rest to rest with minimum-jerk timing.

    Raises:
        TryAgain: control refused or cancelled the motion.
        RobotNotReady: a stop ended it.
    """
    limits = np.array([context.robot.limits[name].velocity for name in joints])
    times_s, positions = minimum_jerk(waypoints, limits * speed_ratio)
    motion_id = context.link.send_trajectory(joints, times_s, positions)
    yield from _finish(context, motion_id, f"moving {_named(joints)}")


def minimum_jerk(
    waypoints: NDArray[np.float64], velocity_limits: NDArray[np.float64], period_s: float = 0.04
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Time waypoints so that no joint exceeds its limit and the ends are at rest.

    The path parameter is 10u^3 - 15u^4 + 6u^5 (Flash and Hogan 1985); its peak rate is 1.875.
    """
    steps = np.abs(np.diff(waypoints, axis=0))
    pace_s = (steps / velocity_limits).max(axis=1)
    along = np.concatenate(([0.0], np.cumsum(np.maximum(pace_s, 1e-6))))
    duration_s = max(0.5, 1.875 * float(along[-1]))
    count = max(2, math.ceil(duration_s / period_s))
    u = np.linspace(0.0, 1.0, count + 1)
    s = (10 * u**3 - 15 * u**4 + 6 * u**5) * along[-1]
    columns = [np.interp(s, along, column) for column in waypoints.T]
    return u * duration_s, np.column_stack(columns)


def settle(context: SkillContext, joints: Sequence[str]) -> Skill:
    """Wait until joints have come to rest."""
    index = [context.robot.joint_index[name] for name in joints]
    yield from wait_until(
        context,
        lambda: bool((np.abs(context.link.velocities[index]) < SETTLED_RAD_S).all()),
        SETTLE_TIMEOUT_S,
    )


def _named(joints: Mapping[str, float] | Sequence[str]) -> str:
    names = list(joints)
    return names[0] if len(names) == 1 else f"{names[0]} and {len(names) - 1} more joints"
