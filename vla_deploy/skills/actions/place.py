"""Put what a hand holds into a container, on or beside an object, or on a surface's free spot."""

import math
from collections.abc import Generator, Iterable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vla_deploy.manipulation.errors import ManipulationError
from vla_deploy.manipulation.grasps import HAND_ABOVE_SUPPORT_M, Grasp, drawn_back, hand_at, raised
from vla_deploy.plans.errors import UnknownObject
from vla_deploy.plans.knowledge import parse_object
from vla_deploy.skills.actions.navigate import solve_near
from vla_deploy.skills.context import Held, Skill, SkillContext
from vla_deploy.skills.errors import NotPossible, OutOfReach, Touched, TryAgain
from vla_deploy.skills.movements.arms import (
    believe_fingers,
    feel_way,
    lift,
    move_straight,
    move_to_posture,
    opening_of,
    set_opening,
)
from vla_deploy.skills.movements.carrying import RESTARTS, carry, empty_targets, or_carry
from vla_deploy.skills.movements.frames import to_base
from vla_deploy.skills.movements.gaze import kept_in_sight, turn_head, watch
from vla_deploy.skills.movements.motion import pause
from vla_deploy.skills.movements.neighbours import MARGIN_M, crowding_m
from vla_deploy.skills.movements.self_clearance import is_clear_of_self
from vla_deploy.skills.movements.surfaces import Spot, free_spots, spots_beside
from vla_deploy.skills.movements.swing import heights_above
from vla_deploy.world import Query
from vla_deploy.world.relations import NEXT_TO
from vla_deploy.world.resting import IN
from vla_deploy.world.vocabulary import CONTAINERS

# A thing put into a container is let go this far below the rim: less where the container is low,
# or where others lie in it, which it must not be pressed on. One put on something: just above.
BELOW_RIM_M = 0.03
DEEP_BELOW_RIM_M = 0.075
ABOVE_FLOOR_M = 0.04
ABOVE_CONTENTS_M = 0.015
ABOVE_SURFACE_M = 0.008
YAWS_RAD = tuple(2 * math.pi * step / 16 for step in range(16))
CLEAR_OF_RIM_M = 0.01
LOST_OPENING_M = 0.012
LOOK_AT_TABLE = (0.0, 0.85)
LET_GO_M = 0.03
ABOVE_SPEED_RATIO = 0.5
OUT_SPEED_RATIO = 0.35
# A hand that lies draws its tips out of what it held, and so far again.
CLEAR_OF_HELD_M = 0.03
# What stands so much early has come down: things are seen and held to a few centimetres. What was
# only felt may reach down much farther than was taken for granted.
EARLY_M, EARLY_UNKNOWN_M = 0.04, 0.10
UNKNOWN = "object"


@dataclass(frozen=True, slots=True, kw_only=True)
class Release:
    """Hold where the grip lets go, in the base frame, and the joint positions above it.

    After that the hand goes up by `above_m`, one that lies by way of `out`, behind what it held:
    `postures` are those at the corners of its way.
    """

    grip: NDArray[np.float64]
    above: NDArray[np.float64]
    above_m: float
    out: NDArray[np.float64] | None
    postures: tuple[NDArray[np.float64], ...] = ()


def place(context: SkillContext, parameters: Mapping[str, Any]) -> Skill:
    """Put what is held `in`, `on` or `next to` a destination within reach.

    Raises:
        NotPossible: nothing is held any more, or was lost on the way, or the spot is out of reach.
        TryAgain: the destination was not seen.
    """
    hand = context.holding_hand(parameters.get("arm"))
    held = context.hands[hand]
    if held is None:
        raise NotPossible(f"the {hand} hand holds nothing")
    if opening_of(context, hand) < held.width_m - LOST_OPENING_M:
        context.hands[hand] = None
        raise NotPossible(f"the {hand} hand has lost the {held.kind} on the way")
    release = yield from _release(context, parameters, hand, held)
    context.keep_only(hand)
    yield from or_carry(context, _put_down(context, hand, held, release), hand)
    context.tell(arm=hand, **{"class": held.kind})
    yield from carry(context, (hand,))


def _put_down(context: SkillContext, hand: str, held: Held, release: Release) -> Skill:
    yield from move_to_posture(context, hand, release.above, ABOVE_SPEED_RATIO)
    yield from _lower(context, hand, held, release)
    believe_fingers(context)
    if context.hands[hand] is None:
        raise NotPossible(f"the {hand} hand has lost the {held.kind} before it was put down")
    yield from set_opening(context, hand, held.width_m + LET_GO_M)
    context.hands[hand] = None
    yield from pause(context, 0.3)
    if release.out is not None:
        yield from move_straight(context, hand, release.out, OUT_SPEED_RATIO)
    yield from lift(context, hand, release.above_m)


def _lower(context: SkillContext, hand: str, held: Held, release: Release) -> Skill:
    """Feel the way down until what is held stands, or would.

    Raises:
        Touched: something is in the way high above that; the hand is over it again.
    """
    arm = context.arms[hand]
    try:
        yield from feel_way(context, hand, release.grip)
    except Touched:
        left_m = float(arm.forward(context.link.positions)[2, 3] - release.grip[2, 3])
        if left_m > (EARLY_UNKNOWN_M if held.kind == UNKNOWN else EARLY_M):
            yield from move_to_posture(context, hand, release.above, ABOVE_SPEED_RATIO)
            raise


def _release(
    context: SkillContext, parameters: Mapping[str, Any], hand: str, held: Held
) -> Generator[None, None, Release]:
    """Return where the grip must be when the fingers open, and the posture above it."""
    try:
        query = parse_object(parameters["destination"])
    except UnknownObject:
        return (yield from _on_surface(context, hand, held))
    relation = str(parameters["relation"])

    def solve() -> Release:
        if relation == NEXT_TO:
            return _beside(context, query, hand, held)
        return _over_object(context, query, relation, hand, held)

    return (yield from solve_near(context, query, solve))


def _on_surface(context: SkillContext, hand: str, held: Held) -> Generator[None, None, Release]:
    """Look at the furniture ahead and choose the first free spot that the hand reaches.

    Raises:
        OutOfReach: there are free spots, all out of reach.
        TryAgain: there is none in sight.
    """
    yield from turn_head(context, *LOOK_AT_TABLE)
    yield from watch(context)
    spots = free_spots(context, hand)
    if not spots:
        raise TryAgain("I see no free spot within reach to put it down")
    return _first_reached(context, hand, spots, held)


def _first_reached(context: SkillContext, hand: str, spots: Iterable[Spot], held: Held) -> Release:
    """Return how to let go at the first of some spots that the hand reaches.

    Raises:
        OutOfReach: it reaches none.
    """
    reason = OutOfReach(f"there is no spot for the {hand} hand")
    for x_m, y_m, z_m in spots:
        point_m = (x_m, y_m, z_m + held.below_grip_m + ABOVE_SURFACE_M)
        try:
            return _solve_above(context, hand, point_m, held)
        except OutOfReach as error:
            reason = error
    raise reason


def _beside(context: SkillContext, query: Query, hand: str, held: Held) -> Release:
    """Choose the first free spot around a thing that the hand reaches.

    Raises:
        OutOfReach: it reaches none of them.
        TryAgain: the thing is not in sight, or nothing around it is free.
    """
    seen = kept_in_sight(context, query)
    spots = spots_beside(context, hand, seen)
    if not spots:
        raise TryAgain(f"I see no free spot next to the {query}")
    return _first_reached(context, hand, spots, held)


def _over_object(
    context: SkillContext, query: Query, relation: str, hand: str, held: Held
) -> Release:
    seen = kept_in_sight(context, query)
    x_m, y_m, z_m = to_base(context.link.pose, seen["position_m"])
    top_m = z_m + float(seen["size_m"][2]) / 2
    if relation == IN and seen["class"] not in CONTAINERS:
        known = " or a ".join(sorted(CONTAINERS))
        raise NotPossible(f"a {seen['class']} is no container; put things in a {known}")
    lower_m = below_rim_m(context, seen, held) if relation == IN else -ABOVE_SURFACE_M
    point_m = (x_m, y_m, top_m - lower_m + held.below_grip_m)
    return _solve_above(context, hand, point_m, held, lower_m + CLEAR_OF_RIM_M, seen["id"])


def below_rim_m(context: SkillContext, container: Mapping[str, Any], held: Held) -> float:
    """Return how deep a thing is lowered into a container: what falls far may topple or break."""
    spare_m = float(container["size_m"][2]) - max(
        ABOVE_FLOOR_M, _filled_m(context, container, held)
    )
    below_m = min(max(spare_m, BELOW_RIM_M), DEEP_BELOW_RIM_M)
    if held.tilt_rad == 0.0:
        return below_m
    # A hand that lies stays above the rim.
    return max(min(below_m, held.below_grip_m - HAND_ABOVE_SUPPORT_M), -ABOVE_SURFACE_M)


def _filled_m(context: SkillContext, container: Mapping[str, Any], held: Held) -> float:
    """Return how high above a container's floor its contents reach, with room to spare.

    What a hand holds may still be remembered where it was taken from, or be seen above the box.
    """
    floor_m = float(container["position_m"][2]) - float(container["size_m"][2]) / 2
    tops_m = [
        float(one["position_m"][2]) + float(one["size_m"][2]) / 2
        for one in context.link.objects
        if "rests" in one
        and one["rests"]["of"] == container["id"]
        and (one["class"], one["colour"]) != (held.kind, held.colour)
    ]
    return max(tops_m) + ABOVE_CONTENTS_M - floor_m if tops_m else 0.0


def _solve_above(
    context: SkillContext,
    hand: str,
    release_m: tuple[float, float, float],
    held: Held,
    least_m: float = 0.0,
    onto: str = "",
) -> Release:
    """Return the posture above a release point that moves the arm least and can descend.

    What was taken from the side is put down as it was taken. The posture is at least `least_m`
    above it: what is held swings in over the rim of a container. `onto` is the id of what it is put
    in or on: nothing else may be where a hand that lies comes down.

    Raises:
        OutOfReach: no yaw of the hand gets there.
    """
    now, reasons = context.link.setpoints, [""]
    aside_m = context.robot.hands[hand].middle_m(held.width_m)
    grips = [
        hand_at(release_m, yaw_rad, held.tilt_rad, aside_m)
        for yaw_rad in YAWS_RAD
        if held.tilt_rad == 0.0 or _has_room(context, hand, release_m, yaw_rad, held, onto)
    ]
    if not grips:
        reasons.append("what stands around leaves no room for a hand that lies")
    least_m = max(context.robot.reach.above_m, least_m)
    for above_m in heights_above(context, release_m, held.below_grip_m, least_m):
        found = [
            release
            for grip in grips
            if (release := _descent(context, hand, grip, above_m, held, reasons)) is not None
        ]
        for release in sorted(found, key=lambda one: float(np.abs(one.above - now).max())):
            if not release.postures or _comes_home(context, hand, held, release):
                return release
            reasons.append("the arm would come too near to the robot itself")
    x_m, y_m, z_m = release_m
    raise OutOfReach(
        f"the {hand} hand cannot reach {x_m:.2f}, {y_m:.2f}, {z_m:.2f} m: {reasons[-1]}"
    )


def _has_room(
    context: SkillContext,
    hand: str,
    release_m: tuple[float, float, float],
    yaw_rad: float,
    held: Held,
    onto: str,
) -> bool:
    """Return whether a hand that lies comes down to a release, and away, beside what stands."""
    own = next((one["id"] for one in context.link.objects if one.get("held_by") == hand), "")
    grasp = Grasp(
        point_m=release_m,
        yaw_rad=yaw_rad,
        width_m=held.width_m,
        opening_m=held.width_m + LET_GO_M,
        effort_ratio=0.0,
        below_grip_m=held.below_grip_m,
        tilt_rad=held.tilt_rad,
        way_in_m=held.width_m / 2 + CLEAR_OF_HELD_M,
    )
    return crowding_m(context, grasp, {"id": own, "rests": {"of": onto}}) <= MARGIN_M


def _comes_home(context: SkillContext, hand: str, held: Held, release: Release) -> bool:
    """Return whether a hand that lies gets to a release and then to where it travels empty."""
    home = release.postures[-1].copy()
    for name, position in empty_targets(context, hand).items():
        home[context.robot.joint_index[name]] = position
    way = [context.link.setpoints, *release.postures, home]
    return is_clear_of_self(context, hand, way, held.width_m + LET_GO_M)


def _descent(
    context: SkillContext,
    hand: str,
    grip: NDArray[np.float64],
    above_m: float,
    held: Held,
    reasons: list[str],
) -> Release | None:
    """Return how the hand gets straight down to a grip and away from it."""
    arm, out = context.arms[hand], None
    corners: tuple[NDArray[np.float64], ...] = ()
    try:
        above = arm.solve(raised(grip, above_m), context.link.setpoints, restarts=RESTARTS)
        at_grip = arm.straight_line(above.positions, grip)[-1]
        if held.tilt_rad != 0.0:
            out = drawn_back(grip, held.width_m / 2 + CLEAR_OF_HELD_M)
            outside = arm.straight_line(at_grip, out)[-1]
            raised_up = arm.straight_line(outside, raised(out, above_m))[-1]
            corners = (above.positions, at_grip, outside, raised_up)
    except ManipulationError as error:
        reasons.append(str(error))
        return None
    return Release(grip=grip, above=above.positions, above_m=above_m, out=out, postures=corners)
