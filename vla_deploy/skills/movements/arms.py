"""Move arms and grippers: straight, to postures and poses, open, close; what the fingers feel."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from drivers.clock import NS_PER_S
from vla_deploy.manipulation.errors import ManipulationError
from vla_deploy.skills.context import Held, Skill, SkillContext
from vla_deploy.skills.errors import NotPossible, OutOfReach, Touched, TryAgain
from vla_deploy.skills.movements.motion import follow_joints, move_joints, pause, settle
from vla_deploy.skills.movements.underside import way_back_m
from vla_deploy.world.touch import is_denied

FULL_EFFORT = 0.5
GENTLE_EFFORT = 0.25
# An empty gripper stops where it was sent; fingers on an object stop this much earlier, pressing.
HELD_OPENING_M = 0.004
HELD_EFFORT_SHARE = 0.4
CLOSE_TIME_S = 0.4
STANDING_RATIO = 0.03
"""Of a joint's largest speed."""
STAND_WITHIN_S = 3.0
# Of the contact limits. On its way down, a free arm of the twin feels 0.14 of them at most.
TOUCH_RATIO = 0.25
FEELING_SPEED_RATIO = 0.15
# Sizes are seen to a centimetre.
SAME_WIDTH_M = 0.012


@dataclass(frozen=True, slots=True, kw_only=True)
class FingerTouch:
    """Say what the fingers feel: their opening, how far short of the goal, and their effort."""

    opening_m: float
    short_of_goal_m: float
    effort_ratio: float

    def holds(self, effort_limit: float) -> bool:
        """Return whether something keeps the fingers apart under pressure."""
        pressing = self.effort_ratio > HELD_EFFORT_SHARE * effort_limit
        return self.short_of_goal_m > HELD_OPENING_M and pressing


def opening_of(context: SkillContext, hand: str) -> float:
    """Return the distance between a hand's fingers in metres."""
    index = context.robot.joint_index[context.robot.gripper_joint(hand)]
    return context.robot.hands[hand].opening_m(float(context.link.positions[index]))


def feel(context: SkillContext, hand: str, goal_opening_m: float) -> FingerTouch:
    """Return what a hand's fingers feel now."""
    index = context.robot.joint_index[context.robot.gripper_joint(hand)]
    opening_m = opening_of(context, hand)
    return FingerTouch(
        opening_m=opening_m,
        short_of_goal_m=opening_m - goal_opening_m,
        effort_ratio=abs(float(context.link.efforts[index])),
    )


def set_opening(
    context: SkillContext, hand: str, opening_m: float, effort_ratio: float = FULL_EFFORT
) -> Skill:
    """Send a hand's fingers to an opening with a bounded effort."""
    joint = context.robot.gripper_joint(hand)
    limits, wanted = context.robot.limits[joint], context.robot.hands[hand].position_at(opening_m)
    targets = {joint: min(max(wanted, limits.min), limits.max)}
    yield from move_joints(context, targets, effort_ratio={joint: effort_ratio})
    yield from pause(context, CLOSE_TIME_S)
    yield from _stand(context, joint)


def _stand(context: SkillContext, joint: str) -> Skill:
    """Wait until a joint stands: fingers of little effort trail far behind their setpoint."""
    index = context.robot.joint_index[joint]
    still = STANDING_RATIO * context.robot.limits[joint].velocity
    end_ns = context.link.working_ns() + round(STAND_WITHIN_S * NS_PER_S)
    while context.link.working_ns() < end_ns and abs(context.link.velocities[index]) > still:
        yield


def open_gripper(context: SkillContext, parameters: Mapping[str, Any]) -> Skill:
    """Open one hand, or both; what was held is let go."""
    for hand in _hands(context, parameters):
        yield from set_opening(context, hand, context.robot.widest_m(hand))
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


def recall_hands(context: SkillContext, told: Mapping[str, Held]) -> bool:
    """Find out by touch what the hands hold after a restart; return False until it can be felt.

    `told` is what the executor before said of them: believed where the fingers are as far apart.
    """
    try:
        for hand in context.robot.hands:
            touch = feel(context, hand, _smallest(context, hand))
            before = told.get(hand)
            if not touch.holds(GENTLE_EFFORT):
                context.hands[hand] = None
            elif before is not None and abs(before.width_m - touch.opening_m) < SAME_WIDTH_M:
                context.hands[hand] = before
            else:
                context.hands[hand] = Held(
                    kind="object", colour="", width_m=touch.opening_m, below_grip_m=0.06
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
        joints = arm_joints(context, parameters["arm"])
        targets = {name: value for name, value in targets.items() if name in joints}
    if not targets:
        raise NotPossible(f"the pose {parameters['pose']} names no joint of that arm")
    if (back_m := way_back_m(context)) > 0.0:
        raise NotPossible(f"an arm is under a table; have me drive {back_m:.2f} m back first")
    yield from move_joints(context, targets)


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
    yield from _along(context, hand, target, speed_ratio, None)


def feel_way(context: SkillContext, hand: str, target: Any, speed_ratio: float = 1.0) -> Skill:
    """Move a hand slowly along a straight line until it is there, or meets something.

    `speed_ratio` is a share of the usual slow speed. A robot whose file has no limits of contact
    feels nothing on its way.

    Raises:
        OutOfReach: the arm cannot follow the line.
        Touched: the arm has met something on it, and rests there.
    """
    try:
        yield from _along(context, hand, target, speed_ratio * FEELING_SPEED_RATIO, TOUCH_RATIO)
    except Touched:
        yield from settle(context, arm_joints(context, hand))
        raise


def _along(
    context: SkillContext,
    hand: str,
    target: Any,
    speed_ratio: float,
    contact_ratio: float | None,
) -> Skill:
    try:
        waypoints = context.arms[hand].straight_line(context.link.setpoints, target)
    except ManipulationError as error:
        raise OutOfReach(str(error)) from error
    joints = arm_joints(context, hand)
    columns = [context.robot.joint_index[name] for name in joints]
    yield from follow_joints(context, joints, waypoints[:, columns], speed_ratio, contact_ratio)
    yield from settle(context, joints)


def move_to_posture(
    context: SkillContext, hand: str, positions: NDArray[np.float64], speed_ratio: float
) -> Skill:
    """Bring a hand's arm to its part of a posture of the whole robot, and let it settle."""
    yield from move_joints(context, arm_targets(context, hand, positions), speed_ratio)
    yield from settle(context, arm_joints(context, hand))


def arm_targets(
    context: SkillContext, hand: str, positions: NDArray[np.float64]
) -> dict[str, float]:
    """Return the part of a posture of the whole robot that is one hand's arm."""
    index = context.robot.joint_index
    return {name: float(positions[index[name]]) for name in arm_joints(context, hand)}


def arm_joints(context: SkillContext, hand: str) -> tuple[str, ...]:
    """Return the joints of a hand's arm."""
    return context.robot.group(context.robot.hands[hand].arm).joints


def _hands(context: SkillContext, parameters: Mapping[str, Any]) -> list[str]:
    return [parameters["arm"]] if "arm" in parameters else list(context.robot.hands)


def _smallest(context: SkillContext, hand: str) -> float:
    robot = context.robot
    return robot.hands[hand].opening_m(robot.limits[robot.gripper_joint(hand)].min)
