"""Move joints and wait for them: the pieces that every bodily skill is made of."""

import math
from collections.abc import Callable, Generator, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from drivers.clock import NS_PER_S
from vla_deploy.client.readiness import refusal_of
from vla_deploy.ipc.ros_goals import GoalRequest
from vla_deploy.skills.actions.beyond import arms_beyond, pursue_all, trajectory_requests
from vla_deploy.skills.context import Skill, SkillContext
from vla_deploy.skills.errors import RobotNotReady, Touched, TryAgain

SETTLED_RAD_S = 0.03
SETTLE_TIMEOUT_S = 1.5
MIN_DURATION_S = 0.5
POINT_PERIOD_S = 0.04
# Waypoints closer together than this are one: their slopes would be noise.
MIN_PACE_S = 1e-4


def pause(context: SkillContext, duration_s: float) -> Skill:
    """Wait for a while."""
    yield from wait_until(context, lambda: False, duration_s)


def wait_until(context: SkillContext, done: Callable[[], bool], timeout_s: float) -> Skill:
    """Wait until `done()` or the time-out; the caller checks which it was."""
    end_ns = context.link.working_ns() + round(timeout_s * NS_PER_S)
    while not done() and context.link.working_ns() < end_ns:
        yield


def _finish(context: SkillContext, motion_id: int, what: str) -> Generator[None, None, bool]:
    """Wait for the end of a motion; return False where a pause was before it."""
    while (result := context.link.ended(motion_id)) is None:
        yield
    if result.is_interrupted:
        return False
    if result.status == "stopped" and refusal_of(context.link.control_status):
        raise RobotNotReady(f"{what}: stopped by control: {result.reason}")
    if result.status == "touched":
        raise Touched(f"{what}: {result.reason}")
    if result.status != "done":
        raise TryAgain(f"{what}: {result.status}: {result.reason}")
    return True


def move_joints(
    context: SkillContext,
    targets: Mapping[str, float],
    speed_ratio: float = 1.0,
    effort_ratio: Mapping[str, float] | None = None,
) -> Skill:
    """Bring joints to targets, all that control moves arriving together.

    Arms that servers beyond the robot move get there in their own time, side by side with these.

    Raises:
        TryAgain: control refused or cancelled the motion, or a stop that ends by itself ended it.
        RobotNotReady: another stop ended it.
        SkillFailed: a server rejected or gave up its part, or nobody knows how it ended.
    """

    def timed(joints: Sequence[str]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        here = context.link.setpoints[[context.robot.joint_index[name] for name in joints]]
        there = [targets.get(name, place) for name, place in zip(joints, here, strict=True)]
        return _timed(context, joints, np.stack([here, np.array(there)]), speed_ratio)

    arms, is_done = arms_beyond(context.robot, tuple(targets)), False
    while not is_done:
        requests = trajectory_requests(context, arms, timed) if arms else []
        beyond = {joint for request in requests for joint in request.joints}
        own = {joint: value for joint, value in targets.items() if joint not in beyond}
        motion_id = context.link.send_goal(own, speed_ratio, effort_ratio) if own else None
        is_done = (yield from pursue_all(context, requests)) if requests else True
        if motion_id is not None:
            is_done &= yield from _finish(context, motion_id, f"moving {_named(own)}")
        if not is_done:
            yield from settle(context, tuple(targets))


def follow_joints(
    context: SkillContext,
    joints: Sequence[str],
    waypoints: NDArray[np.float64],
    speed_ratio: float,
    contact_ratio: float | None = None,
) -> Skill:
    """Move through joint waypoints (n, joints) from rest to rest with minimum-jerk timing.

    An arm that a server beyond the robot moves is moved by control where it feels its way: no
    trajectory controller does that.

    Raises:
        Touched: with a `contact_ratio`, the joints have met something, and rest before it.
        TryAgain: control refused or cancelled the motion, or a stop that ends by itself ended it.
        RobotNotReady: another stop ended it.
        SkillFailed: a server rejected or gave up its part, or nobody knows how it ended.
    """
    way = waypoints
    while True:
        times_s, way = _timed(context, joints, way, speed_ratio)
        requests = _requests_along(context, joints, times_s, way) if contact_ratio is None else []
        if requests:
            is_done = yield from pursue_all(context, requests)
        else:
            motion_id = context.link.send_trajectory(joints, times_s, way, contact_ratio)
            is_done = yield from _finish(context, motion_id, f"moving {_named(joints)}")
        if is_done:
            return
        yield from settle(context, joints)
        columns = [context.robot.joint_index[name] for name in joints]
        way = rest_of(way, context.link.setpoints[columns])


def rest_of(way: NDArray[np.float64], here: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return what is left of a way (n, joints) for joints that have stopped on it."""
    nearest = int(np.argmin(np.linalg.norm(way - here, axis=1)))
    return np.vstack([here, way[min(nearest + 1, len(way) - 1) :]])


def _timed(
    context: SkillContext,
    joints: Sequence[str],
    waypoints: NDArray[np.float64],
    speed_ratio: float,
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    limits = [context.robot.limits[name] for name in joints]
    return minimum_jerk(
        waypoints,
        speed_ratio * np.array([limit.velocity for limit in limits]),
        np.array([limit.acceleration for limit in limits]),
    )


def _requests_along(
    context: SkillContext,
    joints: Sequence[str],
    times_s: NDArray[np.float64],
    positions: NDArray[np.float64],
) -> list[GoalRequest]:
    """Return the goals that have servers follow a way of arms; none where control follows it."""
    arms = arms_beyond(context.robot, joints)
    columns = {name: positions[:, place] for place, name in enumerate(joints)}

    def timed(all_joints: Sequence[str]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        here = context.link.setpoints
        rest = {name: here[context.robot.joint_index[name]] for name in all_joints}
        ways = [columns.get(name, np.full(len(times_s), rest[name])) for name in all_joints]
        return times_s, np.stack(ways, axis=1)

    return trajectory_requests(context, arms, timed) if arms else []


def stay(
    context: SkillContext,
    joints: Sequence[str],
    duration_s: float,
    contact_ratio: float,
    done: Callable[[], bool],
) -> Skill:
    """Keep joints where control holds them for a while, or until `done()`, and feel.

    Raises:
        Touched: something pushes or pulls at them by more than that share of the contact limits.
        TryAgain: control refused or cancelled it, or a stop that ends by itself ended it.
        RobotNotReady: another stop ended it.
    """
    columns = [context.robot.joint_index[name] for name in joints]
    end_ns = context.link.working_ns() + round(duration_s * NS_PER_S)
    while (left_s := (end_ns - context.link.working_ns()) / NS_PER_S) > POINT_PERIOD_S:
        here = context.link.setpoints[columns]
        motion_id = context.link.send_trajectory(
            joints, np.array([0.0, left_s]), np.stack([here, here]), contact_ratio
        )
        for _ in _finish(context, motion_id, f"holding {_named(joints)}"):
            if done():
                context.link.cancel(motion_id)
                return
            yield


def minimum_jerk(
    waypoints: NDArray[np.float64],
    velocity_limits: NDArray[np.float64],
    acceleration_limits: NDArray[np.float64],
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Time waypoints so that no joint exceeds its limits and the ends are at rest.

    The path parameter is 10u^3 - 15u^4 + 6u^5 (Flash and Hogan 1985); its peak rate is 1.875.
    """
    pace_s = (np.abs(np.diff(waypoints, axis=0)) / velocity_limits).max(axis=1)
    kept = np.concatenate(([True], pace_s > MIN_PACE_S))
    along = np.concatenate(([0.0], np.cumsum(pace_s)))[kept]
    duration_s = max(MIN_DURATION_S, 1.875 * float(along[-1]))
    u = np.linspace(0.0, 1.0, max(4, math.ceil(duration_s / POINT_PERIOD_S)) + 1)
    s = (10 * u**3 - 15 * u**4 + 6 * u**5) * along[-1]
    positions = _smooth_through(along, waypoints[kept], s)
    rates = np.diff(positions, axis=0) / u[1]
    bends = np.diff(rates, axis=0) / u[1]
    slowest_s = (np.abs(rates) / velocity_limits).max()
    hardest_s = math.sqrt((np.abs(bends) / acceleration_limits).max())
    return u * max(duration_s, slowest_s, hardest_s), positions


def _smooth_through(
    along: NDArray[np.float64], waypoints: NDArray[np.float64], s: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return points at `s` of a curve through waypoints without corners or overshoot.

    Tangents are harmonic means of the neighbouring slopes, 0 at turning points (Fritsch and
    Butland 1984).
    """
    if len(along) < 2:
        return np.repeat(waypoints[:1], len(s), axis=0)
    slopes = np.diff(waypoints, axis=0) / np.diff(along)[:, None]
    product = slopes[:-1] * slopes[1:]
    mean = 2 * product / np.where(product > 0, slopes[:-1] + slopes[1:], 1.0)
    tangents = np.vstack((slopes[:1], np.where(product > 0, mean, 0.0), slopes[-1:]))
    index = np.clip(np.searchsorted(along, s, side="right") - 1, 0, len(along) - 2)
    width = (along[index + 1] - along[index])[:, None]
    t = ((s - along[index]) / width[:, 0])[:, None]
    return np.asarray(
        (2 * t**3 - 3 * t**2 + 1) * waypoints[index]
        + (t**3 - 2 * t**2 + t) * width * tangents[index]
        + (3 * t**2 - 2 * t**3) * waypoints[index + 1]
        + (t**3 - t**2) * width * tangents[index + 1]
    )


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
