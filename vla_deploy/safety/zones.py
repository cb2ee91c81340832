"""Judge obstacle points around the base against zones: pure geometry, nothing read or changed.

Points are (n, 2) in the base frame: x forward, y left, metres. No zone ever closes every way out:
a STOP zone blocks only motions that bring its points nearer to the footprint.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vla_deploy.robots.protection import Corners, Zone, ZoneKind
from vla_deploy.safety.surroundings import Direction, ZoneFinding

Points = NDArray[np.float64]
Mask = NDArray[np.bool_]

# A motion brings a point nearer when it takes more than this share of its own way off the distance.
NEARER_SHARE = 0.1
# An approach zone slows; it is stop zones that stop, and they know the way out.
LEAST_RATIO = 0.05
_PROBE_M = 0.01
_PROBE_RAD = 0.02
_ARC_STEP_S = 0.05
_STANDING_M_S = 1e-3
_STANDING_RAD_S = 1e-3
_ROUNDING_M = 1e-6


# What each direction does to the base within a probe: x in metres, turn in radians.
PROBES: dict[Direction, tuple[float, float]] = {
    Direction.FORWARD: (_PROBE_M, 0.0),
    Direction.BACKWARD: (-_PROBE_M, 0.0),
    Direction.TURN_LEFT: (0.0, _PROBE_RAD),
    Direction.TURN_RIGHT: (0.0, -_PROBE_RAD),
}


@dataclass(frozen=True, slots=True, kw_only=True)
class Footprint:
    """Bound the base: all within `radius_m` of a polygon, which for a round base is one corner."""

    corners_m: Corners
    radius_m: float

    def distance(self, points: Points) -> Points:
        """Return each point's distance from the footprint, negative inside."""
        if len(self.corners_m) == 1:
            aside = points - self.corners_m[0]
            return np.hypot(aside[:, 0], aside[:, 1]) - self.radius_m
        return signed_distance(points, np.array(self.corners_m)) - self.radius_m


@dataclass(frozen=True, slots=True, kw_only=True)
class BaseMotion:
    """Carry how the base moves and how hard it can brake."""

    v_m_s: float
    w_rad_s: float
    deceleration_m_s2: float

    @property
    def stands(self) -> bool:
        """Return whether the base is too slow for its motion to matter."""
        return abs(self.v_m_s) < _STANDING_M_S and abs(self.w_rad_s) < _STANDING_RAD_S


@dataclass(frozen=True, slots=True, kw_only=True)
class ZoneMemory:
    """Carry a zone's memory between two evaluations; both counts are of samples in a row."""

    hits: int = 0
    misses: int = 0
    active: bool = False
    blocked: tuple[Direction, ...] = ()


IDLE = ZoneMemory()


def inside(points: Points, polygon: Points) -> Mask:
    """Return which points lie inside a polygon, by counting the edges to their right."""
    x, y = points[:, 0, None], points[:, 1, None]
    here, there = polygon, np.roll(polygon, -1, axis=0)
    rise = there[:, 1] - here[:, 1]
    spans = (here[:, 1] > y) != (there[:, 1] > y)
    run = (y - here[:, 1]) / np.where(rise == 0.0, 1.0, rise)
    crossing = here[:, 0] + run * (there[:, 0] - here[:, 0])
    counted: Mask = (spans & (x < crossing)).sum(axis=1) % 2 == 1
    return counted


def signed_distance(points: Points, polygon: Points) -> Points:
    """Return each point's distance to a polygon's edge, negative inside."""
    start, along = polygon, np.roll(polygon, -1, axis=0) - polygon
    length2 = np.maximum((along**2).sum(axis=1), 1e-12)
    offset = points[:, None, :] - start
    share = np.clip((offset * along).sum(axis=2) / length2, 0.0, 1.0)
    gap = offset - share[..., None] * along
    nearest: Points = np.sqrt((gap**2).sum(axis=2)).min(axis=1)
    return np.where(inside(points, polygon), -nearest, nearest)


def moved(points: Points, forward_m: float, turn_rad: float) -> Points:
    """Return where the points are, seen from a base that has driven that arc since."""
    half = 0.5 * turn_rad
    # What numpy.sinc does, to the last bit: on a single number that costs ten times as much.
    angle = math.pi * (half / math.pi)
    chord_m = forward_m * (math.sin(angle) / angle if angle else 1.0)
    shifted = points - (chord_m * math.cos(half), chord_m * math.sin(half))
    c, s = math.cos(turn_rad), math.sin(turn_rad)
    turned: Points = shifted @ np.array([[c, -s], [s, c]])
    return turned


def braking_m(motion: BaseMotion, reaction_s: float) -> float:
    """Return the way from noticing something to standstill."""
    speed = abs(motion.v_m_s)
    return speed * reaction_s + speed**2 / (2.0 * motion.deceleration_m_s2)


def stretched(zone: Zone, motion: BaseMotion) -> Points:
    """Return the zone's polygon, grown along the motion by the way to standstill if it asks so."""
    polygon = np.array(zone.polygon_m, dtype=np.float64)
    if zone.reaction_s is None or abs(motion.v_m_s) < _STANDING_M_S:
        return polygon
    sign = math.copysign(1.0, motion.v_m_s)
    ahead = sign * polygon[:, 0] > 0.0
    polygon[ahead, 0] += sign * braking_m(motion, zone.reaction_s)
    return polygon


def directions_towards(points: Points, footprint: Footprint) -> tuple[Direction, ...]:
    """Return the motions that bring any of the points nearer to the footprint."""
    if len(points) == 0:
        return ()
    before = footprint.distance(points)
    reach = np.linalg.norm(points, axis=1)
    found = []
    for direction, (forward_m, turn_rad) in PROBES.items():
        after = footprint.distance(moved(points, forward_m, turn_rad))
        way = abs(forward_m) + abs(turn_rad) * reach
        if (before - after > NEARER_SHARE * way).any():
            found.append(direction)
    return tuple(found)


def time_to_collision(
    points: Points, footprint: Footprint, motion: BaseMotion, horizon_s: float
) -> float:
    """Return when the base, going on as it does, reaches a point; infinite beyond the horizon.

    What it is already leaving, or touches without coming nearer, does not count.
    """
    if len(points) == 0 or (abs(motion.v_m_s) < _STANDING_M_S and motion.w_rad_s == 0.0):
        return math.inf
    before = footprint.distance(points)
    for step in range(1, math.ceil(horizon_s / _ARC_STEP_S) + 1):
        time_s = min(step * _ARC_STEP_S, horizon_s)
        after = footprint.distance(moved(points, motion.v_m_s * time_s, motion.w_rad_s * time_s))
        hit = (after <= 0.0) & (after < before - _ROUNDING_M)
        if hit.any():
            share = np.maximum(before[hit] / (before[hit] - after[hit]), 0.0)
            return float((share * time_s).min())
    return math.inf


def judge_zone(
    zone: Zone,
    trigger: ZoneMemory,
    points: Points,
    footprint: Footprint,
    motion: BaseMotion,
    *,
    fresh: bool,
) -> tuple[ZoneMemory, ZoneFinding | None]:
    """Return the zone's next memory and what it asks for, None while it is idle.

    Only `fresh` points count towards setting the zone off or ending it.
    """
    collision_s = math.inf
    if zone.kind is ZoneKind.APPROACH:
        found = points
        collision_s = time_to_collision(points, footprint, motion, zone.time_before_collision_s)
        is_hit = math.isfinite(collision_s)
    else:
        found = points[inside(points, stretched(zone, motion))]
        is_hit = len(found) >= zone.min_points
    trigger = _advance(zone, trigger, is_hit, fresh)
    if not trigger.active:
        return trigger, None
    if zone.kind is ZoneKind.STOP and is_hit:
        trigger = _remember(trigger, directions_towards(found, footprint))
    return trigger, _finding(zone, trigger, found, footprint, motion, collision_s)


def _advance(zone: Zone, trigger: ZoneMemory, is_hit: bool, fresh: bool) -> ZoneMemory:
    if not fresh:
        return trigger
    if is_hit:
        hits = min(trigger.hits + 1, zone.trigger_count)
        active = trigger.active or hits >= zone.trigger_count
        return ZoneMemory(hits=hits, active=active, blocked=trigger.blocked)
    misses = trigger.misses + 1
    if not trigger.active or misses >= zone.release_count:
        return IDLE
    return ZoneMemory(misses=misses, active=True, blocked=trigger.blocked)


def _remember(trigger: ZoneMemory, blocked: tuple[Direction, ...]) -> ZoneMemory:
    return ZoneMemory(hits=trigger.hits, misses=trigger.misses, active=True, blocked=blocked)


def _finding(
    zone: Zone,
    trigger: ZoneMemory,
    found: Points,
    footprint: Footprint,
    motion: BaseMotion,
    collision_s: float,
) -> ZoneFinding:
    ratio, measured, limit = zone.speed_ratio, collision_s, zone.time_before_collision_s
    if zone.kind is ZoneKind.APPROACH:
        ratio = min(1.0, max(LEAST_RATIO, collision_s / zone.time_before_collision_s))
    else:
        measured = float(footprint.distance(found).min()) if len(found) else math.inf
        limit = float(footprint.distance(stretched(zone, motion)).max())
    return ZoneFinding(
        kind=zone.kind,
        name=zone.name,
        sources=zone.sources,
        points=len(found),
        measured=measured,
        limit=limit,
        speed_ratio=ratio,
        blocked=trigger.blocked,
    )
