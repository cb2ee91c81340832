"""Bring arms to where they may travel, past what stands on furniture and out from under it."""

import math
from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from vla_deploy.manipulation.errors import ManipulationError
from vla_deploy.manipulation.grasps import hand_at
from vla_deploy.skills.context import Skill, SkillContext
from vla_deploy.skills.errors import NotPossible, OutOfReach, TryAgain
from vla_deploy.skills.movements.arms import arm_joints, arm_targets, lift
from vla_deploy.skills.movements.frames import side_of
from vla_deploy.skills.movements.motion import move_joints, settle
from vla_deploy.skills.movements.underside import leave_underside

AT_POSE_RAD = 0.05
LOADED_SPEED_RATIO, EMPTY_SPEED_RATIO = 0.6, 0.85
FOLDING_STEPS = 12
HOLD_OUT_HEIGHTS = 5
CARRY_YAWS_RAD = tuple(math.radians(degrees) for degrees in range(-180, 180, 30))
# Of a hand that lies, from straight ahead outwards: its wrist is before the chest, and what it
# holds before its shoulder. Inwards its elbow would stand out or its wrist meet the chest.
LYING_HEADINGS_RAD = tuple(math.radians(degrees) for degrees in (30, 60, 90))
# One yaw out of reach is no loss: another is tried at once.
RESTARTS = 2
# Of a hand that lies there are few yaws to choose from.
LYING_RESTARTS = 10
Point = tuple[float, float, float]


def carry(context: SkillContext, hands: Sequence[str] | None = None) -> Skill:
    """Bring arms, all or some, to where they may travel, full hands to where they carry things.

    A hand that is low over furniture is raised first: the way to its chest is no straight line. An
    arm under furniture is drawn out before.

    Raises:
        NotPossible: an arm is under furniture, and the robot cannot drive back.
        TryAgain: something stands behind the robot.
    """
    hands = tuple(context.robot.hands) if hands is None else hands
    if not all(_is_at(context, _travel_targets(context, hand)) for hand in hands):
        yield from leave_underside(context)
    for hand in hands:
        yield from _raise_clear(context, hand)
    targets: dict[str, float] = {}
    for hand in hands:
        wanted = _travel_targets(context, hand)
        if not _is_at(context, wanted):
            targets |= wanted
    if targets:
        loaded = any(held is not None for held in context.hands.values())
        yield from move_joints(
            context, targets, LOADED_SPEED_RATIO if loaded else EMPTY_SPEED_RATIO
        )
        yield from settle(context, list(targets))


def _raise_clear(context: SkillContext, hand: str) -> Skill:
    """Raise a hand that is out in front to a height from which it may swing."""
    reach = context.robot.parts.reach
    point_m = context.arms[hand].forward(context.link.setpoints)[:3, 3]
    missing_m = reach.clear_height_m - float(point_m[2]) if reach else 0.0
    if reach is None or point_m[0] < reach.out_m or missing_m <= 0.0:
        return
    for share in (1.0, 0.5, 0.25):
        try:
            yield from lift(context, hand, share * missing_m)
        except OutOfReach:
            continue  # the arm may be near its limits: less is better than nothing
        return
    yield from _fold_up(context, hand, reach.clear_height_m)


def _fold_up(context: SkillContext, hand: str, clear_height_m: float) -> Skill:
    """Raise a hand by the one joint that raises it most on its way to where it travels empty.

    An arm that sank without power lies so twisted that it follows no straight line; with all of
    its joints at once its hand would sweep over what stands there.
    """
    targets = empty_targets(context, hand)
    ways = {joint: _way_to(context, hand, joint, target) for joint, target in targets.items()}
    joint, way = max(ways.items(), key=lambda item: max(item[1]))
    enough = (one for one in way if one[0] >= clear_height_m)
    _, position = next(enough, max(way))
    yield from move_joints(context, {joint: position}, EMPTY_SPEED_RATIO)
    yield from settle(context, (joint,))


def _way_to(
    context: SkillContext, hand: str, joint: str, target: float
) -> list[tuple[float, float]]:
    """Return the hand's height at positions of one joint on its way to a target."""
    posture, index = context.link.setpoints.copy(), context.robot.joint_index[joint]
    found = []
    for position in np.linspace(posture[index], target, FOLDING_STEPS):
        posture[index] = position
        height_m = float(context.arms[hand].forward(posture)[2, 3])
        found.append((height_m, float(position)))
    return found


def _travel_targets(context: SkillContext, hand: str) -> dict[str, float]:
    point_m = context.robot.hands[hand].carry_point_m
    if context.hands.get(hand) is not None and point_m is not None:
        return _carry_targets(context, hand, point_m)
    return empty_targets(context, hand)


def empty_targets(context: SkillContext, hand: str) -> dict[str, float]:
    """Return where the arm of an empty hand travels; one of no such pose stays where it is."""
    pose, joints = context.robot.hands[hand].travel_pose, arm_joints(context, hand)
    if pose is None:
        return arm_targets(context, hand, context.link.setpoints)
    return {name: context.robot.poses[pose][name] for name in joints}


def _carry_targets(context: SkillContext, hand: str, point_m: Point) -> dict[str, float]:
    """Return the carry posture nearest to the present one."""
    targets = _upright_at(context, hand, point_m)
    if targets is None:
        raise NotPossible(f"the {hand} hand cannot reach its carry point {point_m}")
    return targets


def _upright_at(context: SkillContext, hand: str, point_m: Point) -> dict[str, float] | None:
    """Return the nearest posture in which a hand has what it holds upright at a point.

    That is a hand that points down, unless it took the thing from the side. None out of its reach.
    """
    arm = context.arms[hand]
    now = context.link.setpoints
    held = context.hands.get(hand)
    tilt_rad = 0.0 if held is None else held.tilt_rad
    restarts = RESTARTS if tilt_rad == 0.0 else LYING_RESTARTS
    found = []
    for yaw_rad in _carry_yaws_rad(context, hand, tilt_rad):
        target = hand_at(point_m, yaw_rad, tilt_rad)
        try:
            found.append(arm.solve(target, now, restarts=restarts).positions)
        except ManipulationError:
            continue  # not every yaw is within the wrist's range
    if not found:
        return None
    best = min(found, key=lambda positions: float(np.abs(positions - now).max()))
    return arm_targets(context, hand, best)


def _carry_yaws_rad(context: SkillContext, hand: str, tilt_rad: float) -> tuple[float, ...]:
    if tilt_rad == 0.0:
        return CARRY_YAWS_RAD
    side, over_rad = side_of(context, hand), math.pi if tilt_rad < 0.0 else 0.0
    return tuple(side * heading_rad + over_rad for heading_rad in LYING_HEADINGS_RAD)


def hold_out(context: SkillContext, hand: str) -> Skill:
    """Bring what a hand holds as high and then as far out before its shoulder as it gets.

    Raises:
        NotPossible: it gets nowhere within the reach of the robot file.
    """
    for point_m in _points_out(context, hand):
        targets = _upright_at(context, hand, point_m)
        if targets is not None:
            yield from move_joints(context, targets, LOADED_SPEED_RATIO)
            return
    raise NotPossible(f"the {hand} hand gets to no point of [reach] where it could hold things out")


def _points_out(context: SkillContext, hand: str) -> Iterator[Point]:
    """Yield points before a hand's shoulder from the highest grip down, the farthest first."""
    reach, aside_m = context.robot.reach, float(context.arms[hand].shoulder_m[1])
    low_m, high_m = reach.grip_heights_m
    for height_m in np.linspace(high_m, low_m, HOLD_OUT_HEIGHTS):
        for distance_m in sorted(reach.distances_m, reverse=True):
            if distance_m > abs(aside_m):
                ahead_m = math.sqrt(distance_m**2 - aside_m**2)
                yield ahead_m, aside_m, float(height_m)


def or_carry(context: SkillContext, skill: Skill, hand: str) -> Skill:
    """Run a skill of one hand; where it fails, bring its arm to where it may travel before that."""
    try:
        yield from skill
    except (TryAgain, NotPossible):
        yield from carry(context, (hand,))
        raise


def _is_at(context: SkillContext, targets: Mapping[str, float]) -> bool:
    now, index = context.link.setpoints, context.robot.joint_index
    return all(
        abs(float(now[index[name]]) - value) < AT_POSE_RAD for name, value in targets.items()
    )
