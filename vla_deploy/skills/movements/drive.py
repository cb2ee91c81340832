"""Drive the base: along planned paths, straight, or on the spot; stop for what is in the way."""

import math
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from drivers.clock import NS_PER_S
from vla_deploy.client.place_state import PlaceState
from vla_deploy.navigation.errors import NavigationError
from vla_deploy.navigation.follower import (
    AT_REST,
    DriveLimits,
    FollowerPhase,
    PathFollower,
    Twist,
    is_blocked,
    scan_points,
)
from vla_deploy.navigation.localising.place_judge import MATCH_RATIO
from vla_deploy.robots.description import BaseGeometry
from vla_deploy.robots.errors import PartMissing
from vla_deploy.robots.floor_pose import Pose2D, wrap_angle
from vla_deploy.skills.actions.beyond import navigation_request, pursue, server_drives
from vla_deploy.skills.context import Skill, SkillContext
from vla_deploy.skills.errors import NotPossible, TryAgain
from vla_deploy.skills.movements.bearings import find_myself
from vla_deploy.skills.movements.detour import Detour

# Cruise below what the drives can do, so that tracking errors can be made up.
CRUISE_RATIO = 0.9
STOP_DISTANCE_M = 0.12
BLOCKED_TIMEOUT_S = 5.0
STRAIGHT_TOLERANCE_M = 0.01
LOOK_AHEAD_M = 0.06
# How far from a pose Nav2 may leave the robot and say that it is there: its goal checker is finer.
ARRIVED_M, ARRIVED_RAD = 0.3, 0.5


def base_of(context: SkillContext) -> BaseGeometry:
    """Return the robot's base.

    Raises:
        NotPossible: it has none.
    """
    try:
        return context.robot.base
    except PartMissing as error:
        raise NotPossible(str(error)) from error


def limits_of(context: SkillContext, speed_m_s: float | None = None) -> DriveLimits:
    """Return the speeds at which this robot cruises, no faster than asked."""
    base = base_of(context)
    cruise_m_s = CRUISE_RATIO * base.max_speed_m_s
    return DriveLimits(
        speed_m_s=cruise_m_s if speed_m_s is None else min(cruise_m_s, speed_m_s),
        turn_rate_rad_s=CRUISE_RATIO * base.max_turn_rad_s,
        acceleration_m_s2=0.6 * base.max_acceleration_m_s2,
        turn_acceleration_rad_s2=0.6 * base.max_turn_acceleration_rad_s2,
    )


def drive_to(
    context: SkillContext,
    goal: Pose2D,
    turn: bool = True,
    until: Callable[[], bool] = lambda: False,
    speed_m_s: float | None = None,
) -> Skill:
    """Drive to a pose of the map along a planned path; halt on the way when `until()` holds.

    Where Nav2 drives the base, it plans a path of its own: no pose is asked for that has none here.

    Raises:
        NotPossible: no path leads there.
        TryAgain: the robot is lost, or something blocks the way for too long.
        SkillFailed: Nav2 rejected the pose or gave it up, or nobody knows how it ended.
    """
    base_of(context)
    yield from find_myself(context)
    pose = context.link.pose
    if goal == pose:  # which may be tighter by millimetres than where it would be sent
        return
    try:
        points = context.planner.plan((pose.x_m, pose.y_m), (goal.x_m, goal.y_m))
    except NavigationError as error:
        raise NotPossible(str(error)) from error
    if server_drives(context):
        target = goal if turn else _arriving(points, goal)
        yield from _have_driven(context, target, turn, until, speed_m_s)
        return
    yield from follow(context, points, goal.yaw_rad if turn else None, until, speed_m_s)


def _arriving(points: NDArray[np.float64], goal: Pose2D) -> Pose2D:
    """Return the goal with the yaw in which a path arrives there: Nav2 wants one."""
    far = np.hypot(*(points[:-1] - points[-1]).T) > STOP_DISTANCE_M
    if not far.any():
        return goal
    dx_m, dy_m = points[-1] - points[:-1][far][-1]
    return Pose2D(x_m=goal.x_m, y_m=goal.y_m, yaw_rad=math.atan2(dy_m, dx_m))


def _have_driven(
    context: SkillContext,
    target: Pose2D,
    turn: bool,
    until: Callable[[], bool],
    speed_m_s: float | None,
) -> Skill:
    """Have Nav2 drive to a pose; see that the robot knows its place meanwhile, and is there then.

    What stands in the way is for Nav2 and for control to see.

    Raises:
        TryAgain: the robot did not know its place for too long, or is elsewhere in the end.
        SkillFailed: Nav2 rejected the pose or gave it up, or nobody knows how it ended.
    """
    patience = Patience(context)

    def hindrance() -> str:
        why = _why_blind(context)
        patience.bear(why)
        return why

    request = navigation_request(context, target, speed_m_s)
    yield from pursue(context, request, hindrance, until)
    yield from stand_still(context)
    pose = context.link.pose
    off_m = pose.distance_m(target)
    off_rad = pose.turn_rad(target) if turn else 0.0
    if not until() and (off_m > ARRIVED_M or off_rad > ARRIVED_RAD):
        raise TryAgain(
            f"Nav2 says that the robot is there, but it is {off_m:.2f} m and {off_rad:.2f} rad off"
        )


def follow(
    context: SkillContext,
    points: NDArray[np.float64],
    final_yaw_rad: float | None,
    until: Callable[[], bool] = lambda: False,
    speed_m_s: float | None = None,
) -> Skill:
    """Follow points of the map frame, around what is in the way but not on the map.

    Where no way leads around it, wait for it to go away, and give up on it.

    Raises:
        TryAgain: the way stayed blocked.
    """
    limits = limits_of(context, speed_m_s)
    follower, detour = PathFollower(points, limits, final_yaw_rad), Detour(context, points)
    patience = Patience(context)
    context.way_m = points
    try:
        while follower.phase is not FollowerPhase.ARRIVED and not until():
            pose = context.link.pose
            if detour.revise(pose):
                context.way_m = detour.way
                follower.take_up(detour.way)
            twist = follower.step(pose.x_m, pose.y_m, pose.yaw_rad)
            hindrance = detour.closed_by or hindrance_of(
                context, twist, _distance(pose, points[-1])
            )
            context.link.drive(patience.pass_on(twist, hindrance))
            yield
    finally:
        context.way_m = points[:0]
    context.link.drive(AT_REST)
    yield from stand_still(context)


def move(context: SkillContext, parameters: Mapping[str, Any]) -> Skill:
    """Drive straight for a distance, backward when negative.

    Raises:
        NotPossible: the map shows a wall or furniture on the way.
        TryAgain: the way stayed blocked.
    """
    start, distance_m = context.link.pose, float(parameters["distance_m"])
    context.may_go_on(lambda: {"distance_m": distance_m - _ahead_m(start, context.link.pose)})
    yield from straight(context, distance_m, parameters.get("speed_m_s"))
    tell_place(context)


def straight(context: SkillContext, distance_m: float, speed_m_s: float | None = None) -> Skill:
    """Drive straight, holding the heading; positive is forward.

    Raises:
        NotPossible: the map shows a wall or furniture on the way.
        TryAgain: the way stayed blocked.
    """
    start = context.link.pose
    limits = limits_of(context)
    most_m_s = limits.speed_m_s / 2 if speed_m_s is None else min(limits.speed_m_s, speed_m_s)
    sign = math.copysign(1.0, distance_m)
    patience = Patience(context)
    while True:
        pose = context.link.pose
        left_m = abs(distance_m) - sign * _ahead_m(start, pose)
        if left_m < STRAIGHT_TOLERANCE_M:
            break
        speed = min(most_m_s, math.sqrt(1.2 * limits.acceleration_m_s2 * left_m))
        twist = Twist(sign * max(speed, 0.03), 1.5 * wrap_angle(start.yaw_rad - pose.yaw_rad))
        if _leaves_free_floor(context, sign):
            context.link.drive(AT_REST)
            raise NotPossible(f"the map shows no room for the last {left_m:.2f} m")
        hindrance = hindrance_of(context, twist, left_m, planned=False)
        context.link.drive(patience.pass_on(twist, hindrance))
        yield
    context.link.drive(AT_REST)
    yield from stand_still(context)


def turn(context: SkillContext, parameters: Mapping[str, Any]) -> Skill:
    """Turn on the spot by an angle, counter-clockwise positive, also beyond half a turn.

    Raises:
        TryAgain: control did not let the base turn for too long.
    """
    angle_rad, turned = float(parameters["angle_rad"]), _Turned(context)
    context.may_go_on(lambda: {"angle_rad": angle_rad - turned.by_rad()})
    yield from _turn(context, angle_rad, turned)
    tell_place(context)


def turn_by(context: SkillContext, angle_rad: float) -> Skill:
    """Turn on the spot by an angle, as a part of another skill.

    Raises:
        TryAgain: control did not let the base turn for too long.
    """
    yield from _turn(context, angle_rad, _Turned(context))


def _turn(context: SkillContext, angle_rad: float, turned: "_Turned") -> Skill:
    limits, patience = limits_of(context), Patience(context)
    while abs(left_rad := angle_rad - turned.by_rad()) > 0.02:
        rate = min(limits.turn_rate_rad_s, 2.0 * abs(left_rad))
        twist = Twist(0.0, math.copysign(max(rate, 0.06), left_rad))
        context.link.drive(patience.pass_on(twist, ""))
        yield
    context.link.drive(AT_REST)
    yield from stand_still(context)


def tell_place(context: SkillContext) -> None:
    """Have the result of the acting action tell where the base stands."""
    pose = context.link.pose
    context.tell(x_m=round(pose.x_m, 3), y_m=round(pose.y_m, 3), yaw_rad=round(pose.yaw_rad, 3))


def stand_still(context: SkillContext, duration_s: float = 0.4) -> Skill:
    """Hold the base at rest for a moment, so that what is seen next does not smear."""
    end_ns = context.link.working_ns() + round(duration_s * NS_PER_S)
    while context.link.working_ns() < end_ns:
        context.link.drive(AT_REST)
        yield


class _Turned:
    """Count how far the base has turned, also beyond half a turn."""

    def __init__(self, context: SkillContext) -> None:
        self._link = context.link
        self._yaw_rad = context.link.pose.yaw_rad
        self._sum_rad = 0.0

    def by_rad(self) -> float:
        """Return the angle since the beginning, counter-clockwise positive."""
        yaw_rad = self._link.pose.yaw_rad
        self._sum_rad += wrap_angle(yaw_rad - self._yaw_rad)
        self._yaw_rad = yaw_rad
        return self._sum_rad


class Patience:
    """Hold the base while something hinders it, and give up when that stays.

    What control holds back by itself is asked for on and on: it goes on as soon as control lets it.
    """

    def __init__(self, context: SkillContext) -> None:
        self._link = context.link
        self._clear_ns = context.link.working_ns()

    def pass_on(self, twist: Twist, hindrance: str) -> Twist:
        """Return what to drive now; no hindrance is "".

        Raises:
            TryAgain: the hindrance stayed; the base is at rest.
        """
        try:
            self.bear(hindrance or self._link.held_by_control(twist))
        except TryAgain:
            self._link.drive(AT_REST)
            raise
        return AT_REST if hindrance else twist

    def bear(self, reason: str) -> None:
        """Note whether something hinders the base now; no reason is "".

        Raises:
            TryAgain: something has for too long.
        """
        now_ns = self._link.working_ns()
        if not reason:
            self._clear_ns = now_ns
        elif now_ns - self._clear_ns > BLOCKED_TIMEOUT_S * NS_PER_S:
            raise TryAgain(reason)


def hindrance_of(
    context: SkillContext, twist: Twist, remaining_m: float, planned: bool = True
) -> str:
    """Say what forbids to go on: no scan, one off the map, or something in the strip to be swept.

    A `planned` way keeps clear of what the map shows by itself.
    """
    if abs(twist.v_m_s) < 1e-3:
        return ""
    why, ranges_m = _why_blind(context), context.link.ranges_m
    if why or ranges_m is None:
        return why
    points = scan_points(ranges_m)
    mapped = context.planner.is_mapped(context.link.pose.place(points))
    blocked = is_blocked(
        points * math.copysign(1.0, twist.v_m_s),
        mapped & planned,
        reach_m=min(STOP_DISTANCE_M + abs(twist.v_m_s) * 0.5, remaining_m),
        radius_m=context.robot.base.footprint_radius_m,
    )
    return "something stands in the way" if blocked else ""


def _why_blind(context: SkillContext) -> str:
    """Say why the robot does not know where it drives: no scan, or one off the map; else "".

    A base without a lidar drives blindly, as far as it is told.
    """
    if context.robot.parts.lidar is None:
        return ""
    if context.link.ranges_m is None:
        return "the lidar tells nothing, and without it the robot does not drive"
    if context.link.match_ratio < MATCH_RATIO:
        return "what the lidar sees does not fit the map, so the robot may be elsewhere"
    if context.link.place_state is not PlaceState.TRACKING:
        return f"the robot is not sure where it is: {context.link.place_doubt}"
    return ""


def _leaves_free_floor(context: SkillContext, sign: float) -> bool:
    """Return whether a little further on the map leaves too little room, and less than here."""
    pose = context.link.pose
    ahead, here = pose.outward(sign * LOOK_AHEAD_M, 0.0), (pose.x_m, pose.y_m)
    planner = context.planner
    return not planner.is_free(*ahead) and planner.room_m(*ahead) < planner.room_m(*here)


def _ahead_m(start: Pose2D, pose: Pose2D) -> float:
    """Return how far ahead of where the robot stood it stands now, negative behind."""
    return start.local((pose.x_m, pose.y_m))[0]


def _distance(pose: Pose2D, point: NDArray[np.float64]) -> float:
    return math.hypot(float(point[0]) - pose.x_m, float(point[1]) - pose.y_m)
