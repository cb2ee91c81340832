"""Find the way of a hand that takes a thing from the side: down behind it, in, up, and out."""

from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import Any, Final

import cv2
import numpy as np
from numpy.typing import NDArray

from vla_deploy.manipulation.errors import ManipulationError, PostureUnreachable
from vla_deploy.manipulation.grasps import (
    HAND_ABOVE_SUPPORT_M,
    SIDE_TILTS_RAD,
    Grasp,
    drawn_back,
    raised,
)
from vla_deploy.skills.context import SkillContext
from vla_deploy.skills.movements.neighbours import HALF_THICK_M, MARGIN_M, crowding_m
from vla_deploy.skills.movements.swing import heights_above

Floats = NDArray[np.float64]

NOT_SHELF_M: Final = 0.05
"""What is seen so little above a thing's top is the thing itself."""
HAND_ROOM_M: Final = 0.30
"""A hand that comes from above takes that much above a thing."""
SHELF_THICK_M: Final = 0.03
UNDER_SHELF_M: Final = 0.015
"""Between a shelf and the thing that is lifted under it."""
OUT_OF_SHELF_M: Final = 0.04
"""In front of a shelf's edge the hand goes down."""
IN_STEP_M, FARTHEST_IN_M = 0.04, 0.3
SUPPORT_M: Final = 0.05
"""Surfaces that far from a thing's bottom, at most, are what it stands on."""
BESIDE_M: Final = 0.07
"""Around a joint's middle: half an arm's width, and what a seen surface may lack at its edge."""


@dataclass(frozen=True, slots=True, kw_only=True)
class SideWay:
    """Hold the joint positions to begin at, the poses to go through, and how far to lift.

    `postures` are those at the way's corners. From under a shelf the hand goes out by `out` before
    it may rise further.
    """

    grasp: Grasp
    above: Floats
    before: Floats
    lift_m: float
    out: Floats | None
    postures: tuple[Floats, ...]


def side_way(
    context: SkillContext,
    hand: str,
    grasp: Grasp,
    low: Floats,
    seen: Mapping[str, Any],
    reasons: list[str],
) -> SideWay | None:
    """Return the way to a grasp whose grip pose is `low`; None, and a reason, where there is none.

    Nothing that stands around is in it, and the arm is nowhere lower than the hand may be.
    """
    shelf = shelf_above(context, seen)
    if shelf is not None:
        longer = None if grasp.tilt_rad not in _LEVEL else _before(context, grasp, low, shelf)
        if longer is None:
            reasons.append("a shelf is above it, and the hand does not come from before its edge")
            return None
        grasp = longer
    if crowding_m(context, grasp, seen) > MARGIN_M:
        reasons.append("what stands around it leaves the hand no way in from the side")
        return None
    room_m = None if shelf is None else _room_m(seen, shelf)
    arm, before = context.arms[hand], drawn_back(low, grasp.way_in_m)
    for above_m in heights_above(
        context, _point_m(before), HALF_THICK_M, context.robot.reach.above_m
    ):
        try:
            above = arm.solve(raised(before, above_m), context.link.setpoints, restarts=1)
            down = arm.straight_line(above.positions, before)[-1]
            gripping = arm.straight_line(down, low)[-1]
            lift_m, lifted = _lift_m(context, hand, grasp, low, gripping, room_m)
        except ManipulationError as error:
            reasons.append(str(error))
            continue
        if _is_too_low(context, hand, grasp, (down, gripping)):
            reasons.append(f"the {hand} arm would touch what it stands on")
            continue
        out = None if shelf is None else raised(before, lift_m)
        return SideWay(
            grasp=grasp,
            above=above.positions,
            before=before,
            lift_m=lift_m,
            out=out,
            postures=(above.positions, down, gripping, lifted),
        )
    return None


_LEVEL: Final = (SIDE_TILTS_RAD[0], -SIDE_TILTS_RAD[0])


def shelf_above(context: SkillContext, seen: Mapping[str, Any]) -> Mapping[str, Any] | None:
    """Return the lowest surface that leaves a hand no room above a thing, or None."""
    spot = (float(seen["position_m"][0]), float(seen["position_m"][1]))
    top_m = _top_m(seen)
    near = [
        one
        for one in context.link.surfaces
        if NOT_SHELF_M < float(one["height_m"]) - top_m < HAND_ROOM_M and _inside_m(one, spot) > 0.0
    ]
    return min(near, key=lambda one: float(one["height_m"]), default=None)


def _before(
    context: SkillContext, grasp: Grasp, low: Floats, shelf: Mapping[str, Any]
) -> Grasp | None:
    """Return a grasp with a way in from before a shelf's edge; None where it would be too long."""
    for way_in_m in np.arange(grasp.way_in_m, FARTHEST_IN_M, IN_STEP_M):
        x_m, y_m, _ = _point_m(drawn_back(low, float(way_in_m)))
        if _inside_m(shelf, context.link.pose.outward(x_m, y_m)) < -OUT_OF_SHELF_M:
            return replace(grasp, way_in_m=float(way_in_m))
    return None


def _room_m(seen: Mapping[str, Any], shelf: Mapping[str, Any]) -> float:
    """Return how far a thing may be lifted under a shelf."""
    return float(shelf["height_m"]) - SHELF_THICK_M - UNDER_SHELF_M - _top_m(seen)


def _lift_m(
    context: SkillContext,
    hand: str,
    grasp: Grasp,
    low: Floats,
    gripping: Floats,
    room_m: float | None,
) -> tuple[float, Floats]:
    """Return how far a thing is lifted, and the posture then.

    That is above all around, or as the arm, or a shelf, lets it.

    Raises:
        PostureUnreachable: the arm cannot lift it at all.
    """
    arm = context.arms[hand]
    *higher_m, least_m = (
        heights_above(context, grasp.point_m, grasp.below_grip_m, context.robot.reach.above_m)
        if room_m is None
        else [room_m]
    )
    for lift_m in higher_m:
        with suppress(PostureUnreachable):
            return lift_m, arm.straight_line(gripping, raised(low, lift_m))[-1]
    return least_m, arm.straight_line(gripping, raised(low, least_m))[-1]


def _is_too_low(context: SkillContext, hand: str, grasp: Grasp, postures: Sequence[Floats]) -> bool:
    """Return whether a joint of the arm is over what the thing stands on, and too near to it."""
    bottom_m = grasp.point_m[2] - grasp.below_grip_m
    supports = [
        one for one in context.link.surfaces if abs(float(one["height_m"]) - bottom_m) < SUPPORT_M
    ]
    return any(
        _inside_m(one, spot) > -BESIDE_M
        for spot in _low_spots(context, hand, postures, bottom_m + HAND_ABOVE_SUPPORT_M - 0.005)
        for one in supports
    )


def _low_spots(
    context: SkillContext, hand: str, postures: Sequence[Floats], height_m: float
) -> Iterator[tuple[float, float]]:
    """Yield where in the map the arm has joints below a height."""
    for posture in postures:
        points_m = context.arms[hand].points(posture)
        low = points_m[:, 2] < height_m
        for x_m, y_m in context.link.pose.place(points_m[low, :2]):
            yield float(x_m), float(y_m)


def _inside_m(surface: Mapping[str, Any], spot: tuple[float, float]) -> float:
    """Return how far inside of a surface's edge a spot is."""
    outline = np.array(surface["polygon_m"], dtype=np.float32)
    return float(cv2.pointPolygonTest(outline, spot, measureDist=True))


def _top_m(seen: Mapping[str, Any]) -> float:
    return float(seen["position_m"][2]) + float(seen["size_m"][2]) / 2


def _point_m(pose: Floats) -> tuple[float, float, float]:
    x_m, y_m, z_m = pose[:3, 3].tolist()
    return x_m, y_m, z_m
