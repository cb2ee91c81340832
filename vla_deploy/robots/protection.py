"""Describe what a robot keeps away from and what it counts as contact, as immutable values."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum

Corners = tuple[tuple[float, float], ...]
Point3 = tuple[float, float, float]


class ZoneKind(StrEnum):
    """Name what a zone around the robot does while something is in it."""

    STOP = "stop"
    SLOW = "slow"
    LIMIT = "limit"
    APPROACH = "approach"


class ZoneSource(StrEnum):
    """Name who sees the points of a zone."""

    LIDAR = "lidar"
    DEPTH = "depth"


@dataclass(frozen=True, slots=True, kw_only=True)
class Zone:
    """Bound an area of the floor that moves with the base; x forward, y left, from its centre.

    `min_points` make a sample count, `trigger_count` samples in a row set the zone off and
    `release_count` without them end it. With `reaction_s` the polygon grows by the way to
    standstill. `speed_ratio` is of the base's top speeds. An APPROACH zone has no polygon: it
    looks along the base's arc.
    """

    name: str
    kind: ZoneKind
    sources: tuple[ZoneSource, ...]
    polygon_m: Corners = ()
    min_points: int = 2
    trigger_count: int = 1
    release_count: int = 3
    reaction_s: float | None = None
    speed_ratio: float = 1.0
    time_before_collision_s: float = 0.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Workspace:
    """Bound where a hand's grip may be: a box in the base frame."""

    min_m: Point3
    max_m: Point3


@dataclass(frozen=True, slots=True, kw_only=True)
class ClearanceLimits:
    """Say how near the robot's parts may come to each other and to what stands around.

    `allow` lists pairs of MJCF geoms that may touch.
    """

    self_m: float = 0.005
    floor_m: float = 0.01
    allow: tuple[tuple[str, str], ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class TipOver:
    """Bound the lean, and how much may be used up of the way to the support polygon's edge.

    `min_ratio` of the margin must be left: it is 1 standing level and 0 at tipping. Below
    `slow_below_ratio`, if that is not 0, the base goes ever slower.
    """

    support_m: Corners
    max_lean_rad: float
    min_ratio: float = 0.2
    slow_below_ratio: float = 0.0


@dataclass(frozen=True, slots=True, kw_only=True)
class ContactLimits:
    """Say which torque, beyond what motion and own weight explain, counts as a contact.

    It must leave room for friction and the heaviest payload.
    """

    torque_nm: Mapping[str, float]


@dataclass(frozen=True, slots=True, kw_only=True)
class Protection:
    """Hold what the robot file declares of zones and margins; what it leaves out is not judged."""

    zones: tuple[Zone, ...] = ()
    workspaces: Mapping[str, Workspace] = field(default_factory=dict)
    clearance: ClearanceLimits = ClearanceLimits()
    tip_over: TipOver | None = None
    contact: ContactLimits | None = None


NOTHING_DECLARED = Protection()
