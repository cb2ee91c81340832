"""Declare what the judge is told of the robot's surroundings and of its own body: values only.

Whoever computes these numbers says what is; `causes.py` and `SafetyLimits` say what is allowed.
None means that nothing is known, 0 and () that it is known to be nothing.
"""

import math
from dataclasses import dataclass
from enum import StrEnum
from typing import Final

import numpy as np
from numpy.typing import NDArray

from vla_deploy.robots.protection import ZoneKind as ZoneKind
from vla_deploy.robots.protection import ZoneSource as ZoneSource


class Direction(StrEnum):
    """Name the base's motions that may be forbidden one by one; left is counter-clockwise."""

    FORWARD = "forward"
    BACKWARD = "backward"
    TURN_LEFT = "turn_left"
    TURN_RIGHT = "turn_right"


@dataclass(frozen=True, slots=True, kw_only=True)
class ZoneFinding:
    """Describe one zone that something is in.

    `measured` is the distance of the nearest point and `limit` how far the zone reaches, both in m
    from the footprint; of an APPROACH zone the time until the base meets one, and the time that it
    looks ahead, in s. While it waits for its release `measured` is infinite. `speed_ratio` is of
    the base's top speeds, to which both speeds are then bounded together. `blocked` are the motions
    that would bring the base nearer; the way out is not among them.
    """

    kind: ZoneKind
    name: str
    sources: tuple[ZoneSource, ...]
    points: int
    measured: float
    limit: float
    speed_ratio: float
    blocked: tuple[Direction, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class KeepOut:
    """Hold how deep the base's footprint is within a keep-out area, and what leads deeper."""

    name: str
    depth_m: float
    blocked: tuple[Direction, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class Excess:
    """Hold which group is how far outside the workspace; the rate is positive on the way out."""

    subject: str
    excess_m: float
    rate_m_s: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Clearance:
    """Hold the smallest distance of a pair of bodies; a positive rate closes the gap.

    `least_m` is how near this pair may come: less than all others' where it lay nearer when power
    came.
    """

    first: str
    second: str
    distance_m: float
    closing_m_s: float
    least_m: float = math.inf


@dataclass(frozen=True, slots=True, kw_only=True)
class Surroundings:
    """Carry what one tick knows beyond joints and wheels.

    `tip_margin_ratio` is 1 on level ground and 0 where the robot begins to tip.
    `external_torque_nm` (N for a finger) is what no model of the robot itself explains, per joint.
    An age of None means that such a measurement has never arrived. `depth_due_s` is the age beyond
    which the depth camera is overdue at the rate that it is asked for.
    """

    zones: tuple[ZoneFinding, ...] = ()
    keep_out: KeepOut | None = None
    workspace: Excess | None = None
    self_clearance: Clearance | None = None
    environment_clearance: Clearance | None = None
    tip_margin_ratio: float | None = None
    external_torque_nm: NDArray[np.float64] | None = None
    scan_age_s: float | None = None
    depth_age_s: float | None = None
    depth_due_s: float = 0.0
    pose_age_s: float | None = None
    imu_age_s: float | None = None


NOTHING_KNOWN: Final = Surroundings()
