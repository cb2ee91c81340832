"""Move arms and grippers: carry poses, named poses, open, close, and what the fingers feel."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vla_deploy.manipulation.errors import ManipulationError
from vla_deploy.manipulation.grasps import hand_down
from vla_deploy.skills.context import Held, Skill, SkillContext
from vla_deploy.skills.errors import NotPossible, OutOfReach, TryAgain
from vla_deploy.skills.motion import follow_joints, move_joints, pause, settle
from vla_deploy.skills.underside import leave_underside, way_back_m
from vla_deploy.world.touch import is_denied

AT_POSE_RAD = 0.05
LOADED_SPEED_RATIO, EMPTY_SPEED_RATIO = 0.6, 0.85
# In the base frame: the hand is over furniture, and above what stands on it.
OUT_IN_FRONT_M = 0.3
CLEAR_HEIGHT_M = 0.6
TUCK = "tuck"
# Where a loaded hand travels, in the base frame: pointing down, close in front of the chest.
CARRY_POINT_M = (0.27, 0.16, 0.72)
CARRY_YAWS_RAD = tuple(math.radians(degrees) for degrees in range(-180, 180, 30))
# One yaw out of reach is no loss: another is tried at once.
RESTARTS = 2
FULL_EFFORT = 0.5
GENTLE_EFFORT = 0.25
# An empty gripper stops where it was sent; fingers on an object stop this much earlier, pressing.
HELD_OPENING_M = 0.004
HELD_EFFORT_SHARE = 0.4
CLOSE_TIME_S = 0.4


@dataclass(frozen=True, slots=True, kw_only=True)
class Touch:
    """Say what the fingers feel: their opening, how far short of the goal, and their effort."""

    opening_m: float
    short_of_goal_m: float
    effort_ratio: float

    def holds(self, effort_limit: float) -> bool:
        """Tell whether something keeps the fingers apart under pressure."""
        pressing = self.effort_ratio > HELD_EFFORT_SHARE * effort_limit
        return self.short_of_goal_m > HELD_OPENING_M and pressing


def opening_of(context: SkillContext, hand: str) -> float:
    """Return the distance between a hand's fingers in metres."""
    described = context.robot.hands[hand]
    index = context.robot.joint_index[described.gripper]
    return float(context.link.positions[index]) * described.opening_ratio


def feel(context: SkillContext, hand: str, goal_opening_m: float) -> Touch:
    """Return what a hand's fingers feel now."""
    index = context.robot.joint_index[context.robot.hands[hand].gripper]
    opening_m = opening_of(context, hand)
    return Touch(
        opening_m=opening_m,
        short_of_goal_m=opening_m - goal_opening_m,
        effort_ratio=abs(float(context.link.efforts[index])),
    )


def set_opening(
    context: SkillContext, hand: str, opening_m: float, effort_ratio: float = FULL_EFFORT
) -> Skill:
    """Send a hand's fingers to an opening with a bounded effort."""
    described = context.robot.hands[hand]
    limits = context.robot.limits[described.gripper]
    position = min(max(opening_m / described.opening_ratio, limits.min), limits.max)
    targets = {described.gripper: position}
    yield from move_joints(context, targets, effort_ratio={described.gripper: effort_ratio})
    yield from pause(context, CLOSE_TIME_S)


def open_gripper(context: SkillContext, parameters: Mapping[str, Any]) -> Skill:
    """Open one hand, or both; what was held is let go."""
    for hand in _hands(context, parameters):
        limits = context.robot.limits[context.robot.hands[hand].gripper]
        yield from set_opening(context, hand, limits.max * context.robot.hands[hand].opening_ratio)
        context.hands[hand] = None


def close_gripper(context: SkillContext, parameters: Mapping[str, Any]) -> Skill:
    """Close one hand, or both, gently; remember it if something is between the fingers."""
    for hand in _hands(context, parameters):
        yield from set_opening(context, hand, 0.0, GENTLE_EFFORT)
        touch = feel(context, hand, _smallest(context, hand))
        if touch.holds(GENTLE_EFFORT) and context.hands.get(hand) is None:
            context.hands[hand] = Held(
                kind="object", colour="", width_m=touch.opening_m, below_grip_m=0.05
            )


def recall_hands(context: SkillContext) -> bool:
    """Find out by touch what the hands hold after a restart; return False until it can be felt."""
    try:
        for hand in context.robot.hands:
            touch = feel(context, hand, _smallest(context, hand))
            held = touch.holds(GENTLE_EFFORT)
            context.hands[hand] = (
                Held(kind="object", colour="", width_m=touch.opening_m, below_grip_m=0.06)
                if held
                else None
            )
    except TryAgain:
        return False
    return True


def believe_fingers(context: SkillContext) -> None:
    """Take what the fingers are sure not to feel for lost: it has slipped out, or been taken."""
    felt = context.link.hands
    for hand, held in context.hands.items():
        if held is not None and is_denied(felt.get(hand), held.kind):
            context.hands[hand] = None


def move_arm(context: SkillContext, parameters: Mapping[str, Any]) -> Skill:
    """Bring the arms, or one arm, to a named pose of the robot file.

    Raises:
        NotPossible: the pose names no joint of that arm, or an arm is under a table.
    """
    targets = dict(context.robot.poses[parameters["pose"]])
    if "arm" in parameters:
        joints = _arm_joints(context, parameters["arm"])
        targets = {name: value for name, value in targets.items() if name in joints}
    if not targets:
        raise NotPossible(f"the pose {parameters['pose']} names no joint of that arm")
    if (back_m := way_back_m(context)) > 0.0:
        raise NotPossible(f"an arm is under a table; have me drive {back_m:.2f} m back first")
    yield from move_joints(context, targets)


def carry(context: SkillContext) -> Skill:
    """Bring both arms to where they may travel: tucked when empty, close in front when loaded.

    A hand that is low over furniture is raised first: the way to its chest is no straight line. An
    arm under furniture is drawn out before.

    Raises:
        NotPossible: an arm is under furniture, and the robot cannot drive back.
        TryAgain: something stands behind the robot.
    """
    yield from leave_underside(context)
    for hand in context.robot.hands:
        yield from _raise_clear(context, hand)
    targets: dict[str, float] = {}
    for hand in context.robot.hands:
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
    point_m = context.arms[hand].forward(context.link.setpoints)[:3, 3]
    missing_m = CLEAR_HEIGHT_M - float(point_m[2])
    if point_m[0] < OUT_IN_FRONT_M or missing_m <= 0.0:
        return
    for share in (1.0, 0.5, 0.25):
        try:
            yield from lift(context, hand, share * missing_m)
        except OutOfReach:
            continue  # the arm may be near its limits: less is better than nothing
        return


def _travel_targets(context: SkillContext, hand: str) -> dict[str, float]:
    if context.hands.get(hand) is not None:
        return _carry_targets(context, hand)
    pose = context.robot.poses[TUCK]
    return {name: pose[name] for name in _arm_joints(context, hand)}


def _carry_targets(context: SkillContext, hand: str) -> dict[str, float]:
    """Return the carry posture nearest to the present one."""
    arm = context.arms[hand]
    side = 1.0 if hand == "left" else -1.0
    point = (CARRY_POINT_M[0], side * CARRY_POINT_M[1], CARRY_POINT_M[2])
    now = context.link.setpoints
    found = []
    for yaw_rad in CARRY_YAWS_RAD:
        try:
            found.append(arm.solve(hand_down(point, yaw_rad), now, restarts=RESTARTS).positions)
        except ManipulationError:
            continue  # not every yaw is within the wrist's range
    if not found:
        raise NotPossible(f"the {hand} hand cannot reach its carry pose {point}")
    best = min(found, key=lambda positions: float(np.abs(positions - now).max()))
    return _arm_targets(context, hand, best)


def lift(context: SkillContext, hand: str, height_m: float, speed_ratio: float = 0.4) -> Skill:
    """Raise a hand straight up.

    Raises:
        OutOfReach: the arm cannot follow the line.
    """
    target = context.arms[hand].forward(context.link.setpoints)
    target[2, 3] += height_m
    yield from move_straight(context, hand, target, speed_ratio)


def move_straight(context: SkillContext, hand: str, target: Any, speed_ratio: float) -> Skill:
    """Move a hand along a straight line to a grip pose in the base frame.

    Raises:
        OutOfReach: the arm cannot follow the line.
    """
    try:
        waypoints = context.arms[hand].straight_line(context.link.setpoints, target)
    except ManipulationError as error:
        raise OutOfReach(str(error)) from error
    joints = _arm_joints(context, hand)
    columns = [context.robot.joint_index[name] for name in joints]
    yield from follow_joints(context, joints, waypoints[:, columns], speed_ratio)
    yield from settle(context, joints)


def move_to_posture(
    context: SkillContext, hand: str, positions: NDArray[np.float64], speed_ratio: float
) -> Skill:
    """Bring a hand's arm to its part of a posture of the whole robot, and let it settle."""
    yield from move_joints(context, _arm_targets(context, hand, positions), speed_ratio)
    yield from settle(context, _arm_joints(context, hand))


def or_carry(context: SkillContext, skill: Skill) -> Skill:
    """Run a skill; where it fails, bring the arms to where they may travel before saying so."""
    try:
        yield from skill
    except (TryAgain, NotPossible):
        yield from carry(context)
        raise


def _arm_targets(
    context: SkillContext, hand: str, positions: NDArray[np.float64]
) -> dict[str, float]:
    index = context.robot.joint_index
    return {name: float(positions[index[name]]) for name in _arm_joints(context, hand)}


def _arm_joints(context: SkillContext, hand: str) -> tuple[str, ...]:
    return context.robot.group(context.robot.hands[hand].arm).joints


def _hands(context: SkillContext, parameters: Mapping[str, Any]) -> list[str]:
    return [parameters["arm"]] if "arm" in parameters else list(context.robot.hands)


def _smallest(context: SkillContext, hand: str) -> float:
    described = context.robot.hands[hand]
    return context.robot.limits[described.gripper].min * described.opening_ratio


def _is_at(context: SkillContext, targets: Mapping[str, float]) -> bool:
    now, index = context.link.setpoints, context.robot.joint_index
    return all(
        abs(float(now[index[name]]) - value) < AT_POSE_RAD for name, value in targets.items()
    )
