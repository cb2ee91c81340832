"""Choose how a hand takes a thing, by inverse kinematics and by what stands around."""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vla_deploy.manipulation.errors import ManipulationError
from vla_deploy.manipulation.grasps import (
    SIDE_TILTS_RAD,
    Grasp,
    GraspKind,
    grasps_from_above,
    grasps_from_side,
    hand_at,
    raised,
    side_refusal,
    takes_from_side,
)
from vla_deploy.skills.context import Held, SkillContext
from vla_deploy.skills.errors import NotPossible, OutOfReach
from vla_deploy.skills.movements.carrying import RESTARTS
from vla_deploy.skills.movements.frames import side_of, to_base
from vla_deploy.skills.movements.neighbours import crowding_m
from vla_deploy.skills.movements.self_clearance import is_clear_of_self
from vla_deploy.skills.movements.side_way import SideWay, shelf_above, side_way
from vla_deploy.skills.movements.swing import heights_above

FINGER_TIPS_M = 0.03
# Between a jaw that does not move and the side of the thing: more than the thing's place is wrong.
FIXED_JAW_GAP_M = 0.008
# The sine of the angle from which on fingers close along another line.
ANOTHER_LINE = math.sin(math.radians(40.0))

Floats = NDArray[np.float64]
Size = tuple[float, float, float]


@dataclass(frozen=True, slots=True, kw_only=True)
class GraspChoice:
    """Hold the hand, the grasp, the way to it and what will then be held.

    `above` are the joint positions at its beginning, above everything around; from there the hand
    goes straight from one pose of `way` to the next, then up by `lift_m`, then `out`, if there is.
    From the side, `postures` are those at the corners.
    """

    hand: str
    grasp: Grasp
    above: Floats
    way: tuple[Floats, ...]
    lift_m: float
    out: Floats | None
    held: Held
    postures: tuple[Floats, ...] = ()


def kinds_for(context: SkillContext, seen: Mapping[str, Any] | None) -> tuple[GraspKind, ...]:
    """Return the kinds of grasp to try on a thing, the plainest first.

    It is taken from above as long as that is free; from the side what stands and is round.
    """
    turning = any(takes_from_side(context.robot, hand) for hand in context.robot.hands)
    if seen is None or not turning or side_refusal(str(seen["class"]), _size_m(seen)):
        return (GraspKind.TOP,)
    if _is_barred_above(context, seen):
        return (GraspKind.SIDE, GraspKind.TOP)
    return (GraspKind.TOP, GraspKind.SIDE)


def choose_grasp(
    context: SkillContext,
    seen: Mapping[str, Any],
    hands: Sequence[str],
    kind: GraspKind,
    met: Sequence[float],
) -> GraspChoice:
    """Return the plainest of the reachable grasps, of the hand on the object's side.

    `met` are the yaws at which fingers met it: others are taken if there are any.

    Raises:
        OutOfReach: no hand gets there.
        NotPossible: no hand opens so far, or it is not grasped so.
    """
    centre = to_base(context.link.pose, seen["position_m"])
    reasons: list[str] = []
    nearer_first = sorted(hands, key=lambda name: side_of(context, name) * centre[1] < 0.0)
    for hand, grasps in _offered(context, seen, nearer_first, kind):
        choices = [
            choice for grasp in grasps if (choice := _solve(context, hand, grasp, seen, reasons))
        ]
        plainest = _plainest(context, choices, seen, met, reasons)
        if plainest is not None:
            return plainest
    raise OutOfReach(
        f"neither grasp of the {seen['class']} at {centre[0]:.2f}, {centre[1]:.2f}, "
        f"{centre[2]:.2f} m is within reach: {reasons[0] if reasons else 'no grasp fits'}"
    )


def _offered(
    context: SkillContext, seen: Mapping[str, Any], hands: Sequence[str], kind: GraspKind
) -> Iterator[tuple[str, list[Grasp]]]:
    """Yield hands with grasps that fit, the plainest first.

    Raises:
        NotPossible: none does.
    """
    centre = to_base(context.link.pose, seen["position_m"])
    name, size_m = str(seen["class"]), _size_m(seen)
    yaw_rad = float(seen["yaw_rad"]) - context.link.pose.yaw_rad
    try:
        if kind is GraspKind.TOP:
            for hand in hands:
                widest_m = context.robot.widest_m(hand)
                yield hand, grasps_from_above(name, centre, size_m, yaw_rad, widest_m)
            return
        turning = [hand for hand in hands if takes_from_side(context.robot, hand)]
        if not turning:
            raise NotPossible(f"from the side takes an arm of six joints, not the {hands[0]} one")
        for tilt_rad in SIDE_TILTS_RAD:
            for hand in turning:
                widest_m, shoulder_m = context.robot.widest_m(hand), context.arms[hand].shoulder_m
                yield hand, grasps_from_side(name, centre, size_m, shoulder_m, widest_m, tilt_rad)
    except ManipulationError as error:
        raise NotPossible(str(error)) from error


def _plainest(
    context: SkillContext,
    choices: list[GraspChoice],
    seen: Mapping[str, Any],
    met: Sequence[float],
    reasons: list[str],
) -> GraspChoice | None:
    """Return the one that leaves most room to what stands around, then the one that moves least.

    One that closes along another line than those that have met the object goes before both. A hand
    that lies must get there past the rest of the robot, too.
    """
    now = context.link.setpoints

    def cost(one: GraspChoice) -> tuple[bool, float, float]:
        along = any(abs(math.sin(one.grasp.yaw_rad - yaw_rad)) < ANOTHER_LINE for yaw_rad in met)
        rounded_m = round(crowding_m(context, one.grasp, seen), 2)
        return along, rounded_m, float(np.abs(one.above - now).max())

    for choice in sorted(choices, key=cost):
        way = [now, *choice.postures]
        if not choice.postures or is_clear_of_self(
            context, choice.hand, way, choice.grasp.opening_m
        ):
            return choice
        reasons.append(f"the {choice.hand} arm would come too near to the robot itself")
    return None


def _solve(
    context: SkillContext, hand: str, grasp: Grasp, seen: Mapping[str, Any], reasons: list[str]
) -> GraspChoice | None:
    held = Held(
        kind=str(seen["class"]),
        colour=str(seen["colour"]),
        width_m=grasp.width_m,
        below_grip_m=grasp.below_grip_m,
        tilt_rad=grasp.tilt_rad,
    )
    low = _hand_at(context, hand, grasp)
    if grasp.kind is GraspKind.SIDE:
        way = side_way(context, hand, grasp, low, seen, reasons)
        return None if way is None else _by_side_way(hand, way, low, held)
    above = _above(context, hand, grasp, low, reasons)
    if above is None:
        return None
    posture, above_m = above
    return GraspChoice(
        hand=hand, grasp=grasp, above=posture, way=(low,), lift_m=above_m, out=None, held=held
    )


def _by_side_way(hand: str, way: SideWay, low: Floats, held: Held) -> GraspChoice:
    return GraspChoice(
        hand=hand,
        grasp=way.grasp,
        above=way.above,
        way=(way.before, low),
        lift_m=way.lift_m,
        out=way.out,
        held=held,
        postures=way.postures,
    )


def _above(
    context: SkillContext, hand: str, grasp: Grasp, low: Floats, reasons: list[str]
) -> tuple[Floats, float] | None:
    """Return a posture above a grasp from which the hand can go straight down, and how high."""
    arm, least_m = context.arms[hand], context.robot.reach.above_m
    for above_m in heights_above(context, grasp.point_m, FINGER_TIPS_M, least_m):
        try:
            above = arm.solve(raised(low, above_m), context.link.setpoints, restarts=RESTARTS)
            arm.straight_line(above.positions, low)
        except ManipulationError as error:
            reasons.append(str(error))
            continue  # lower, the arm may get there
        return above.positions, above_m
    return None


def _hand_at(context: SkillContext, hand: str, grasp: Grasp) -> Floats:
    """Return where the grip is for a grasp; a jaw that does not move is beside the thing."""
    aside_m = context.robot.hands[hand].middle_m(grasp.width_m, FIXED_JAW_GAP_M)
    return hand_at(grasp.point_m, grasp.yaw_rad, grasp.tilt_rad, aside_m)


def _is_barred_above(context: SkillContext, seen: Mapping[str, Any]) -> bool:
    """Return whether something lies on a thing, or a shelf is close above it."""
    rests = (one.get("rests") or {"of": ""} for one in context.link.objects)
    return any(rest["of"] == seen["id"] for rest in rests) or bool(shelf_above(context, seen))


def _size_m(seen: Mapping[str, Any]) -> Size:
    length_m, width_m, height_m = (float(side) for side in seen["size_m"])
    return length_m, width_m, height_m
