"""Pick an object up: see it afresh, choose a grasp, take it, feel it, lift it, feel again."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vla_deploy.manipulation.errors import ManipulationError
from vla_deploy.manipulation.grasps import Grasp, grasps_from_above, hand_down, raised
from vla_deploy.plans.knowledge import parse_object
from vla_deploy.robots import RobotDescription
from vla_deploy.skills.actions.navigate import solve_near
from vla_deploy.skills.context import Held, Skill, SkillContext
from vla_deploy.skills.errors import NotPossible, OutOfReach, Touched, TryAgain
from vla_deploy.skills.movements.arms import (
    feel,
    feel_way,
    lift,
    move_to_posture,
    set_opening,
)
from vla_deploy.skills.movements.carrying import RESTARTS, carry, or_carry
from vla_deploy.skills.movements.frames import side_of, to_base
from vla_deploy.skills.movements.gaze import kept_in_sight
from vla_deploy.skills.movements.motion import pause
from vla_deploy.skills.movements.neighbours import crowding_m
from vla_deploy.skills.movements.swing import heights_above
from vla_deploy.world import Query
from vla_deploy.world.vocabulary import ANY_CLASS

FINGER_TIPS_M = 0.03
APPROACH_SPEED_RATIO = 0.5
STRAIGHT_SPEED_RATIO = 0.35
# The fingers are sent this much past the surface they should meet.
SQUEEZE_M = 0.012
# Between a jaw that does not move and the side of the thing: more than the thing's place is wrong.
FIXED_JAW_GAP_M = 0.008
MOST_TOUCHES = 3
# The sine of the angle from which on fingers close along another line.
ANOTHER_LINE = math.sin(math.radians(40.0))


@dataclass(frozen=True, slots=True, kw_only=True)
class GraspChoice:
    """Hold the hand, the grasp, the joint positions above it and what will then be held."""

    hand: str
    grasp: Grasp
    above: NDArray[np.float64]
    above_m: float
    held: Held


def pick_up(context: SkillContext, parameters: Mapping[str, Any]) -> Skill:
    """Grasp an object within reach, verified by the fingers' opening and effort.

    Raises:
        NotPossible: no hand is free, or none reaches the object.
        TryAgain: it was not seen, or the grasp did not hold.
    """
    query = parse_object(parameters["object"])
    if _already_held(context, query):
        return
    hands = _free_hands(context, parameters.get("arm"))
    yield from carry(context)
    met: list[float] = []
    while True:
        choice = yield from solve_near(context, query, partial(_choose, context, query, hands, met))
        context.keep_only(choice.hand)
        try:
            yield from or_carry(context, _grasp(context, choice, query), choice.hand)
            break
        except Touched:
            yield from context.take_all_again()
            met.append(choice.grasp.yaw_rad)
            if len(met) == MOST_TOUCHES:
                raise
    context.tell(arm=choice.hand, **{"class": choice.held.kind})
    yield from carry(context, (choice.hand,))


def _grasp(context: SkillContext, choice: GraspChoice, query: Query) -> Skill:
    if len(context.robot.hands) > 1:
        context.note(f"with the {choice.hand} hand")
    yield from _approach(context, choice)
    yield from _take(context, choice, query)


def _approach(context: SkillContext, choice: GraspChoice) -> Skill:
    """Bring the open fingers around the object; where one comes down on it, raise the hand again.

    Raises:
        Touched: the fingers met something on their way down, and are above it again.
    """
    grasp, hand = choice.grasp, choice.hand
    yield from set_opening(context, hand, grasp.opening_m)
    yield from move_to_posture(context, hand, choice.above, APPROACH_SPEED_RATIO)
    try:
        yield from feel_way(context, hand, _hand_at(context, hand, grasp))
    except Touched:
        yield from move_to_posture(context, hand, choice.above, STRAIGHT_SPEED_RATIO)
        raise


def _take(context: SkillContext, choice: GraspChoice, query: Query) -> Skill:
    """Close, feel, lift, feel again; open when nothing is held."""
    grasp, hand = choice.grasp, choice.hand
    goal_m = max(grasp.width_m - 2 * SQUEEZE_M, 0.004)
    yield from set_opening(context, hand, goal_m, grasp.effort_ratio)
    touch = feel(context, hand, goal_m)
    if touch.holds(grasp.effort_ratio):
        context.hands[hand] = choice.held
        yield from lift(context, hand, choice.above_m)
        yield from pause(context, 0.3)
        touch = feel(context, hand, goal_m)
        if touch.holds(grasp.effort_ratio):
            return
    context.hands[hand] = None
    yield from set_opening(context, hand, grasp.opening_m)
    raise TryAgain(
        f"the {hand} hand does not hold the {query}: fingers {touch.opening_m * 1000:.0f} mm apart "
        f"(expected {grasp.width_m * 1000:.0f}), effort {touch.effort_ratio:.2f}"
    )


def _already_held(context: SkillContext, query: Query) -> bool:
    """Return whether a hand holds what is meant: by the scene, or by kind where it cannot tell.

    An id means one thing, and no other of its kind.
    """
    scene = context.link.snapshot()
    full = {hand: held for hand, held in context.hands.items() if held is not None}
    if scene is not None and any(one.held_by in full for one in query.among(scene)):
        return True
    known = {one.held_by for one in scene.things} if scene is not None else set()
    wanted = (query.kind, query.colour)
    return not query.thing_id and any(
        wanted in ((held.kind, held.colour), (held.kind, ""))
        for hand, held in full.items()
        if hand not in known
    )


def _free_hands(context: SkillContext, wanted: str | None) -> list[str]:
    free = [name for name in context.robot.hands if context.hands.get(name) is None]
    if wanted is not None:
        free = [name for name in free if name == wanted]
    if not free:
        full = ", ".join(f"{name}: {held.kind}" for name, held in context.hands.items() if held)
        raise NotPossible(f"no hand is free ({full}); put something down first")
    return free


def _choose(
    context: SkillContext, query: Query, hands: list[str], met: Sequence[float]
) -> GraspChoice:
    """Return the plainest of the reachable grasps, of the hand on the object's side.

    `met` are the yaws at which fingers came down on it: others are taken if there are any.

    Raises:
        TryAgain: the object is out of sight.
        OutOfReach: no hand gets there.
        NotPossible: its size is not known, or no hand opens so far.
    """
    seen = kept_in_sight(context, query)
    pose = context.link.pose
    centre = to_base(pose, seen["position_m"])
    require_known_height(context.robot, str(seen["class"]), centre)
    yaw_rad = float(seen["yaw_rad"]) - pose.yaw_rad
    reasons: list[str] = []
    nearer_first = sorted(hands, key=lambda name: side_of(context, name) * centre[1] < 0.0)
    for hand in nearer_first:
        widest_m = context.robot.widest_m(hand)
        size_m = tuple(float(side) for side in seen["size_m"])
        try:
            grasps = grasps_from_above(
                str(seen["class"]), centre, (size_m[0], size_m[1], size_m[2]), yaw_rad, widest_m
            )
        except ManipulationError as error:
            raise NotPossible(str(error)) from error
        choices = [
            choice for grasp in grasps if (choice := _solve(context, hand, grasp, seen, reasons))
        ]
        if choices:
            return _plainest(context, choices, seen, met)
    raise OutOfReach(
        f"neither grasp of the {seen['class']} at {centre[0]:.2f}, {centre[1]:.2f}, "
        f"{centre[2]:.2f} m is within reach: {reasons[0] if reasons else 'no grasp fits'}"
    )


def require_known_height(robot: RobotDescription, kind: str, centre_m: Sequence[float]) -> None:
    """Refuse what a camera without depth sees and cannot tell the height of.

    Raises:
        NotPossible: nothing of known size has its outline.
    """
    if kind == ANY_CLASS and not robot.camera.has_depth:
        raise NotPossible(
            f"how high the {kind} at {centre_m[0]:.2f}, {centre_m[1]:.2f} m is, is not known: the "
            "camera has no depth, and no [[things]] of the robot file has its outline; add its size"
        )


def _plainest(
    context: SkillContext, choices: list[GraspChoice], seen: Mapping[str, Any], met: Sequence[float]
) -> GraspChoice:
    """Return the one that leaves most room to what stands around, then the one that moves least.

    One that closes along another line than those that have met the object goes before both.
    """
    now = context.link.setpoints

    def cost(one: GraspChoice) -> tuple[bool, float, float]:
        along = any(abs(math.sin(one.grasp.yaw_rad - yaw_rad)) < ANOTHER_LINE for yaw_rad in met)
        rounded_m = round(crowding_m(context, one.grasp, seen), 2)
        return along, rounded_m, float(np.abs(one.above - now).max())

    return min(choices, key=cost)


def _solve(
    context: SkillContext, hand: str, grasp: Grasp, seen: Mapping[str, Any], reasons: list[str]
) -> GraspChoice | None:
    solved = _above(context, hand, grasp, reasons)
    if solved is None:
        return None
    above, above_m = solved
    held = Held(
        kind=str(seen["class"]),
        colour=str(seen["colour"]),
        width_m=grasp.width_m,
        below_grip_m=grasp.below_grip_m,
    )
    return GraspChoice(hand=hand, grasp=grasp, above=above, above_m=above_m, held=held)


def _above(
    context: SkillContext, hand: str, grasp: Grasp, reasons: list[str]
) -> tuple[NDArray[np.float64], float] | None:
    """Return a posture above a grasp from which the hand can go straight down, and how high."""
    arm, low = context.arms[hand], _hand_at(context, hand, grasp)
    least_m = context.robot.reach.above_m
    for above_m in heights_above(context, grasp.point_m, FINGER_TIPS_M, least_m):
        try:
            above = arm.solve(raised(low, above_m), context.link.setpoints, restarts=RESTARTS)
            arm.straight_line(above.positions, low)
        except ManipulationError as error:
            reasons.append(str(error))
            continue  # lower, the arm may get there
        return above.positions, above_m
    return None


def _hand_at(context: SkillContext, hand: str, grasp: Grasp) -> NDArray[np.float64]:
    """Return where the grip is for a grasp; a jaw that does not move is beside the thing."""
    aside_m = context.robot.hands[hand].middle_m(grasp.width_m, FIXED_JAW_GAP_M)
    return hand_down(grasp.point_m, grasp.yaw_rad, aside_m)
