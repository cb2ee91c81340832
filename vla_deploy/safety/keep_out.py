"""Judge how deep the base is, or is about to be, within areas of the floor it must not enter."""

from collections.abc import Mapping

import numpy as np

from vla_deploy.safety.surroundings import Direction, KeepOut
from vla_deploy.safety.zones import (
    NEARER_SHARE,
    PROBES,
    BaseMotion,
    Footprint,
    Points,
    braking_m,
    moved,
    signed_distance,
)


def seen_from(polygon: Points, x_m: float, y_m: float, yaw_rad: float) -> Points:
    """Return a polygon of the map frame as it lies around a base at that pose."""
    c, s = np.cos(yaw_rad), np.sin(yaw_rad)
    turned: Points = (polygon - (x_m, y_m)) @ np.array([[c, -s], [s, c]])
    return turned


def judge_keep_out(
    areas: Mapping[str, Points], footprint: Footprint, motion: BaseMotion, reaction_s: float
) -> KeepOut | None:
    """Return the area that the footprint is deepest in, now or where the base can stand still.

    `areas` are polygons in the base frame. What leads deeper into any of them is blocked. None
    while the footprint stays outside all of them.
    """
    way_m = float(np.copysign(braking_m(motion, reaction_s), motion.v_m_s))
    depths = {
        name: max(_depth(area, footprint), _depth(moved(area, way_m, 0.0), footprint))
        for name, area in areas.items()
    }
    entered = [name for name, depth_m in depths.items() if depth_m > 0.0]
    if not entered:
        return None
    deepest = max(entered, key=lambda name: depths[name])
    into = {one for name in entered for one in _directions_into(areas[name], footprint)}
    return KeepOut(
        name=deepest,
        depth_m=depths[deepest],
        blocked=tuple(direction for direction in PROBES if direction in into),
    )


def _depth(area: Points, footprint: Footprint) -> float:
    corners = np.array(footprint.corners_m)
    return float((footprint.radius_m - signed_distance(corners, area)).max())


def _directions_into(area: Points, footprint: Footprint) -> tuple[Direction, ...]:
    before = _depth(area, footprint)
    reach_m = float(np.linalg.norm(footprint.corners_m, axis=1).max())
    found = []
    for direction, (forward_m, turn_rad) in PROBES.items():
        way_m = abs(forward_m) + abs(turn_rad) * reach_m
        deeper_m = _depth(moved(area, forward_m, turn_rad), footprint) - before
        if deeper_m > max(NEARER_SHARE * way_m, 1e-9):
            found.append(direction)
    return tuple(found)
