"""Judge what lidar and depth camera see against the zones of the robot file."""

import math
from typing import Final

import numpy as np

from vla_deploy.control.judging.body_shapes import BodyShapes
from vla_deploy.control.judging.nearby import Nearby
from vla_deploy.control.motion.axes import Floats
from vla_deploy.ipc import SharedSpace
from vla_deploy.robots import RobotDescription
from vla_deploy.robots.kinematics.model import RobotModel
from vla_deploy.robots.protection import Zone, ZoneSource
from vla_deploy.safety.surroundings import ZoneFinding
from vla_deploy.safety.zones import (
    IDLE,
    BaseMotion,
    Footprint,
    Points,
    ZoneMemory,
    braking_m,
    judge_zone,
)

# Of the base's top speed; no base that is led by control gets there.
_FASTEST_RATIO: Final = 1.5
_ROUNDING_M: Final = 1e-6


class ZoneWatch:
    """Hold every zone's memory, and the findings of the last look."""

    def __init__(
        self,
        space: SharedSpace,
        robot: RobotDescription,
        model: RobotModel,
        body: BodyShapes,
        footprint: Footprint,
    ) -> None:
        self.findings: tuple[ZoneFinding, ...] = ()
        self._zones = robot.protection.zones
        self._footprint = footprint
        self._nearby = {source: Nearby(source, space, robot, model, body) for source in ZoneSource}
        self._triggers: dict[str, ZoneMemory] = {}
        self._stands = False
        self._radius_m = footprint.radius_m
        self._reach_m = reaches_m(robot)

    @property
    def scan_age_s(self) -> float | None:
        """Return the age of the last scan, None before the first."""
        return self._nearby[ZoneSource.LIDAR].age_s

    @property
    def depth_age_s(self) -> float | None:
        """Return the age of what the depth camera told last, None before the first."""
        return self._nearby[ZoneSource.DEPTH].age_s

    @property
    def depth_due_s(self) -> float:
        """Return the age beyond which the depth camera is overdue at its own rate."""
        return self._nearby[ZoneSource.DEPTH].due_s

    def look(self, now_ns: int, position: Floats, motion: BaseMotion) -> None:
        """Judge all zones; nothing new around a base that stands leaves them as they were."""
        points = {
            source: nearby.points(now_ns, position, motion)
            for source, nearby in self._nearby.items()
        }
        stood, self._stands = self._stands, motion.stands
        fresh = any(nearby.fresh for nearby in self._nearby.values())
        if fresh or not (stood and self._stands):
            self.findings = tuple(self._judge(points, motion))

    def close(self) -> None:
        """Unmap the topics."""
        for nearby in self._nearby.values():
            nearby.close()

    def _judge(self, points: dict[ZoneSource, Points], motion: BaseMotion) -> list[ZoneFinding]:
        distances2 = {source: (seen**2).sum(axis=1) for source, seen in points.items()}
        nearest_m = {
            source: math.sqrt(seen2.min(initial=math.inf)) for source, seen2 in distances2.items()
        }
        found = []
        for zone in self._zones:
            before = self._triggers.get(zone.name, IDLE)
            here_m = min(nearest_m[source] for source in zone.sources)
            if before is IDLE and here_m > reach_m(zone, motion, self._radius_m) + _ROUNDING_M:
                continue  # an idle zone stays so as long as there is nothing where it reaches
            trigger, finding = judge_zone(
                zone,
                before,
                self._near(zone, points, distances2),
                self._footprint,
                motion,
                fresh=any(self._nearby[source].fresh for source in zone.sources),
            )
            self._triggers[zone.name] = trigger
            if finding is not None:
                found.append(finding)
        return found

    def _near(
        self, zone: Zone, points: dict[ZoneSource, Points], distances2: dict[ZoneSource, Floats]
    ) -> Points:
        """Return the points that may matter to a zone."""
        reach2 = self._reach_m[zone.name] ** 2
        return np.concatenate([points[one][distances2[one] <= reach2] for one in zone.sources])


def reaches_m(robot: RobotDescription) -> dict[str, float]:
    """Return how far from the base's centre a point can matter to each zone."""
    base = robot.parts.base
    if base is None:
        return {}
    top = BaseMotion(
        v_m_s=_FASTEST_RATIO * base.max_speed_m_s,
        w_rad_s=0.0,
        deceleration_m_s2=base.max_acceleration_m_s2,
    )
    return {
        zone.name: reach_m(zone, top, base.footprint_radius_m) for zone in robot.protection.zones
    }


def reach_m(zone: Zone, motion: BaseMotion, footprint_radius_m: float) -> float:
    """Return how far from the base's centre a point can matter to a zone in that motion."""
    corner_m = max((math.hypot(x, y) for x, y in zone.polygon_m), default=footprint_radius_m)
    driven_m = abs(motion.v_m_s) * zone.time_before_collision_s
    return corner_m + max(driven_m, braking_m(motion, zone.reaction_s or 0.0))
