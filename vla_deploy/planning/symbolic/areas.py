"""Keep the base out of zones: points, straight ways, and things that only stand within them."""

import math
from collections.abc import Iterator

from vla_deploy.planning.knowledge import World
from vla_deploy.robots.description import KeepOutZone
from vla_deploy.world.footprint import polygon_depth_m
from vla_deploy.world.reach import IsFree, stands_around

Point = tuple[float, float]
STEP_M = 0.1


def zone_at(point_m: Point, world: World) -> KeepOutZone | None:
    """Return the zone that the base would enter at a point, or None."""
    return next(
        (zone for zone in world.zones
         if polygon_depth_m(point_m, zone.polygon_m) > -world.footprint_radius_m), None
    )  # fmt: skip


def zone_on_way(start: Point, end: Point, world: World) -> KeepOutZone | None:
    """Return the first zone that a straight way newly enters, or None."""
    if not world.zones or zone_at(start, world) is not None:
        return None
    found = (zone_at(point, world) for point in _points(start, end))
    return next((zone for zone in found if zone is not None), None)


def zone_around(position_m: tuple[float, float, float], world: World) -> KeepOutZone | None:
    """Return the zone that a thing lies in, or in which one would stand to reach it, or None."""
    lies_in = (one for one in world.zones if polygon_depth_m(position_m, one.polygon_m) > 0.0)
    inside = next(lies_in, None)
    if inside is not None:
        return inside
    near = zone_at(position_m[:2], world)
    if near is None:
        return None
    stands = stands_around(position_m, lambda x_m, y_m: zone_at((x_m, y_m), world) is None)
    return near if next(stands, None) is None else None


def blocked_on_way(start: Point, end: Point, is_free: IsFree) -> float | None:
    """Return how far a straight way leads over free floor, None where all of it is free.

    Furniture that the robot stands at may be nearer than the map allows; away from it is free.
    """
    was_free = is_free(*start)
    for point in _points(start, end):
        now_free = is_free(*point)
        if not now_free and (was_free or point == end):
            return math.dist(start, point)
        was_free = was_free or now_free
    return None


def _points(start: Point, end: Point) -> Iterator[Point]:
    count = max(1, math.ceil(math.dist(start, end) / STEP_M))
    for step in range(1, count + 1):
        share = step / count
        yield (
            end
            if step == count
            else (start[0] + share * (end[0] - start[0]), start[1] + share * (end[1] - start[1]))
        )
