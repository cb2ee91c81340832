"""Judge whether a thing can be taken, from where, and what is in the way, each with its reason.

The arms reach what is straight ahead of the base, at a distance that suits.
"""

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import Any, Final, Self

from vla_deploy.manipulation.errors import TooWide
from vla_deploy.manipulation.grasps import (
    TIP_BEYOND_GRIP_M,
    Grasp,
    grasps_from_above,
    side_grip_m,
    side_refusal,
    takes_from_side,
)
from vla_deploy.robots import RobotDescription
from vla_deploy.robots.reach import Reach
from vla_deploy.world.footprint import depth_inside_m
from vla_deploy.world.resting import IN, ON
from vla_deploy.world.thing import Rest, Snapshot, Thing, Viewpoint

DIRECTIONS: Final = 36

# What of a hand goes down beside a thing: two fingers from below the grip, the palm from above it.
FINGER_RADIUS_M: Final = 0.018
PALM_RADIUS_M: Final = 0.045
PALM_ABOVE_GRIP_M: Final = 0.07
WALL_M: Final = 0.008
UNSURE_M: Final = 0.06

IsFree = Callable[[float, float], bool]


class GraspStand(StrEnum):
    """Say from where a thing is within the arms' reach."""

    HERE = "here"
    AFTER_DRIVING = "after driving"
    NONE = "no"


class Bar(StrEnum):
    """Name what may be in the way of taking a thing."""

    HELD = "held"
    ON_TOP = "on top"
    TOO_WIDE = "too wide"
    TOO_HIGH = "too high"
    TOO_LOW = "too low"
    CLOSED_IN = "closed in"
    BESIDE = "beside"
    NO_STAND = "no stand"
    UNSURE = "place unsure"
    HANDS_FULL = "hands full"


@dataclass(frozen=True, slots=True, kw_only=True)
class Stand:
    """Place the base's centre on the floor at a distance from a thing, facing along a bearing."""

    x_m: float
    y_m: float
    bearing_rad: float
    reach_m: float
    step: int


def stands_around(
    position_m: Sequence[float], is_free: IsFree, reach: Reach | None
) -> Iterator[Stand]:
    """Yield for each direction the free stand from which a point of the map is best reached."""
    for step in range(DIRECTIONS):
        bearing_rad = 2.0 * math.pi * step / DIRECTIONS
        for reach_m in () if reach is None else reach.distances_m:
            x_m = position_m[0] - reach_m * math.cos(bearing_rad)
            y_m = position_m[1] - reach_m * math.sin(bearing_rad)
            if is_free(x_m, y_m):
                yield Stand(x_m=x_m, y_m=y_m, bearing_rad=bearing_rad, reach_m=reach_m, step=step)
                break


@dataclass(frozen=True, slots=True)
class Obstacle:
    """Say what is in the way; `by` is the id of a thing, "" where none is."""

    bar: Bar
    by: str
    why: str

    def document(self) -> dict[str, str]:
        """Return it as the scene query tells it."""
        return {"bar": self.bar.value, "by": self.by, "why": self.why}


@dataclass(frozen=True, slots=True, kw_only=True)
class Body:
    """Say what the robot takes things with; `is_free` None means that no map is at hand."""

    opening_max_m: float
    hands: tuple[str, ...]
    reach: Reach | None
    is_free: IsFree | None = None
    takes_from_side: bool = True

    @classmethod
    def of(cls, robot: RobotDescription, is_free: IsFree | None) -> Self:
        """Read a robot file: the widest opening of its hands, and their names."""
        openings_m = [robot.widest_m(hand) for hand in robot.hands]
        return cls(
            opening_max_m=max(openings_m, default=0.0),
            hands=tuple(robot.hands),
            reach=robot.parts.reach,
            is_free=is_free,
            takes_from_side=any(takes_from_side(robot, hand) for hand in robot.hands),
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class GraspAccess:
    """Say whether and from where a thing can be taken."""

    way: GraspStand
    is_graspable: bool
    obstacles: tuple[Obstacle, ...]

    @property
    def is_accessible(self) -> bool:
        """Return whether nothing is in the way."""
        return not self.obstacles

    def document(self) -> dict[str, Any]:
        """Return it as the scene query tells it."""
        return {
            "reachable": self.way.value,
            "graspable": self.is_graspable,
            "accessible": self.is_accessible,
            "obstacles": [one.document() for one in self.obstacles],
        }


def access_to(thing: Thing, snapshot: Snapshot, body: Body) -> GraspAccess:
    """Judge one thing; the obstacles are in the order in which one would clear them."""
    grasps, too_wide = _grasps(thing, body)
    way = grasp_stand(thing, snapshot.robot, body.is_free, body.reach)
    found = [*_general(thing, snapshot, body), *too_wide, *_height(thing, grasps, body)]
    found += _in_corridor(thing, grasps, snapshot) if grasps else []
    if way is GraspStand.NONE:
        found.append(Obstacle(Bar.NO_STAND, "", "no free floor from which the arms reach it"))
    return GraspAccess(way=way, is_graspable=bool(grasps), obstacles=tuple(found))


def _general(thing: Thing, snapshot: Snapshot, body: Body) -> Iterator[Obstacle]:
    if thing.held_by:
        yield Obstacle(Bar.HELD, "", f"the {thing.held_by} hand holds it")
    full = {one.held_by for one in snapshot.things if one.held_by}
    if not thing.held_by and body.hands and full.issuperset(body.hands):
        yield Obstacle(Bar.HANDS_FULL, "", "no hand is free")
    for other in snapshot.things:
        if other.rests == Rest(ON, thing.thing_id):
            yield Obstacle(Bar.ON_TOP, other.thing_id, f"the {other} is on it")
    if max(thing.sigma_m[:2]) > UNSURE_M:
        yield Obstacle(
            Bar.UNSURE, "", f"its place is known to {max(thing.sigma_m[:2]):.2f} m only; look first"
        )


def _grasps(thing: Thing, body: Body) -> tuple[list[Grasp], list[Obstacle]]:
    try:
        return grasps_from_above(
            thing.kind, thing.position_m, thing.size_m, thing.yaw_rad, body.opening_max_m
        ), []
    except TooWide as error:
        return [], [Obstacle(Bar.TOO_WIDE, "", str(error))]


def _height(thing: Thing, grasps: list[Grasp], body: Body) -> Iterator[Obstacle]:
    reach = body.reach
    for grasp in grasps[:1]:
        height_m = grasp.point_m[2]
        why = "" if reach is None else reach.height_refusal(height_m)
        if reach is not None and why and not _is_taken_from_side(thing, body):
            is_low = height_m < reach.grip_heights_m[0]
            yield Obstacle(Bar.TOO_LOW if is_low else Bar.TOO_HIGH, "", why)


def _is_taken_from_side(thing: Thing, body: Body) -> bool:
    """Return whether a hand gets to the side of a thing of which the top is too high or low."""
    height_m = thing.bottom_m + side_grip_m(thing.size_m)
    can_be = body.takes_from_side and not side_refusal(thing.kind, thing.size_m)
    return can_be and body.reach is not None and not body.reach.height_refusal(height_m)


def grasp_stand(
    thing: Thing, robot: Viewpoint | None, is_free: IsFree | None, reach: Reach | None
) -> GraspStand:
    """Return from where a thing can be taken; without a map, after driving."""
    if reach is None:
        return GraspStand.NONE
    if robot is not None and reach.has(robot.local(thing.position_m)):
        return GraspStand.HERE
    if is_free is None:
        return GraspStand.AFTER_DRIVING
    has_stand = next(stands_around(thing.position_m, is_free, reach), None) is not None
    return GraspStand.AFTER_DRIVING if has_stand else GraspStand.NONE


def _in_corridor(thing: Thing, grasps: list[Grasp], snapshot: Snapshot) -> list[Obstacle]:
    """Return what bars the grasp that least bars; nothing where one is free."""
    best: dict[str, Obstacle] | None = None
    for grasp in grasps:
        bars = {one.by: one for one in _bars_of(grasp, thing, snapshot)}
        if best is None or len(bars) < len(best):
            best = bars
    return list((best or {}).values())


def _bars_of(grasp: Grasp, thing: Thing, snapshot: Snapshot) -> Iterator[Obstacle]:
    for other in snapshot.things:
        if other is thing or other.held_by or _carries(thing, other):
            continue
        holds = thing.rests == Rest(IN, other.thing_id)
        for point_m, radius_m, from_m in _discs(grasp):
            depth_m = depth_inside_m(point_m, other)
            if other.top_m <= from_m:
                continue
            if holds and depth_m < radius_m + WALL_M:
                yield Obstacle(
                    Bar.CLOSED_IN, other.thing_id, f"too deep, or too near a wall, in the {other}"
                )
            elif not holds and depth_m > -radius_m:
                yield Obstacle(
                    Bar.BESIDE, other.thing_id, f"the {other} is where a finger would go"
                )


def _discs(grasp: Grasp) -> Iterator[tuple[tuple[float, float], float, float]]:
    """Yield centre, radius and lowest height of what of a hand goes down to a grasp."""
    x_m, y_m, z_m = grasp.point_m
    aside_m = 0.5 * grasp.opening_m + 0.5 * FINGER_RADIUS_M
    across = (math.sin(grasp.yaw_rad), -math.cos(grasp.yaw_rad))
    for side in (-aside_m, aside_m):
        at = (x_m + side * across[0], y_m + side * across[1])
        yield at, FINGER_RADIUS_M, z_m - TIP_BEYOND_GRIP_M
    yield (x_m, y_m), PALM_RADIUS_M, z_m + PALM_ABOVE_GRIP_M


def _carries(thing: Thing, other: Thing) -> bool:
    """Return whether `other` is what a thing stands on, or stands on it: neither is beside it."""
    below = thing.rests == Rest(ON, other.thing_id)
    above = other.rests is not None and other.rests.of == thing.thing_id
    return below or above
