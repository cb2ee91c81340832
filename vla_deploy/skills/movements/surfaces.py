"""Find free spots on the surfaces in front of the robot."""

import math
from collections.abc import Iterator, Mapping
from typing import Any

import cv2
import numpy as np

from vla_deploy.robots.floor_pose import Pose2D
from vla_deploy.skills.context import SkillContext
from vla_deploy.skills.movements.frames import side_of, to_base
from vla_deploy.world.document import read_thing
from vla_deploy.world.footprint import depth_inside_m
from vla_deploy.world.thing import Thing

EDGE_M = 0.06
# What is put beside a thing stands so much farther off than room for the fingers asks for.
FURTHER_M = 0.01
FARTHEST_M = 0.5
DIRECTIONS = 24
ON_SURFACE_M = 0.05
Spot = tuple[float, float, float]


def free_spots(context: SkillContext, hand: str) -> list[Spot]:
    """Return points of seen surfaces, in the base frame, with room for a hand; the best first."""
    side, reach = side_of(context, hand), context.robot.reach
    low_m, high_m = reach.grip_heights_m
    return [
        (x_m, side * y_m, height_m)
        for surface in context.link.surfaces
        if low_m - ON_SURFACE_M <= (height_m := float(surface["height_m"])) <= high_m
        for x_m in reach.put_ahead_m
        for y_m in reach.put_aside_m
        if _fits(context, surface, x_m, side * y_m)
    ]


def spots_beside(context: SkillContext, hand: str, seen: Mapping[str, Any]) -> list[Spot]:
    """Return free points around a thing on the surface that it stands on, in the base frame.

    They are near enough for what is put down there to stand next to it; the best to reach come
    first.
    """
    thing, pose, reach = read_thing(seen), context.link.pose, context.robot.reach
    x_m, y_m, _ = to_base(pose, thing.position_m)
    best_m = (reach.distances_m[0], side_of(context, hand) * reach.put_aside_m[0])
    spots = [
        (*spot, height_m)
        for surface in context.link.surfaces
        if abs((height_m := float(surface["height_m"])) - thing.bottom_m) < ON_SURFACE_M
        for spot in _around(thing, (x_m, y_m), pose, reach.apart_m)
        if _fits(context, surface, *spot)
    ]
    return sorted(spots, key=lambda spot: math.dist(spot[:2], best_m))


def _around(
    thing: Thing, middle_m: tuple[float, float], pose: Pose2D, apart_m: float
) -> Iterator[tuple[float, float]]:
    """Yield points of the base frame at a hand's breadth from a thing's outline."""
    for step in range(DIRECTIONS):
        angle_rad = 2 * math.pi * step / DIRECTIONS
        for away_m in np.arange(apart_m, FARTHEST_M, 0.01):
            x_m = middle_m[0] + away_m * math.cos(angle_rad)
            y_m = middle_m[1] + away_m * math.sin(angle_rad)
            if depth_inside_m(pose.outward(x_m, y_m), thing) < -(apart_m + FURTHER_M):
                yield x_m, y_m
                break


def _fits(context: SkillContext, surface: Mapping[str, Any], x_m: float, y_m: float) -> bool:
    """Return whether a spot lies well within the seen surface and away from what stands on it."""
    spot = context.link.pose.outward(x_m, y_m)
    outline = np.array(surface["polygon_m"], dtype=np.float32)
    if cv2.pointPolygonTest(outline, spot, measureDist=True) < EDGE_M:
        return False
    things, apart_m = map(read_thing, context.link.objects), context.robot.reach.apart_m
    return all(depth_inside_m(spot, one) < -apart_m for one in things if not one.held_by)
