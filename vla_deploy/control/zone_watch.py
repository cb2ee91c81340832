"""Judge what lidar and depth camera see against the zones of the robot file."""

import numpy as np

from vla_deploy.control.axes import Floats
from vla_deploy.control.body_shapes import BodyShapes
from vla_deploy.control.nearby import Nearby
from vla_deploy.ipc import SharedSpace
from vla_deploy.robots import RobotDescription
from vla_deploy.robots.model import RobotModel
from vla_deploy.robots.protection import Zone, ZoneSource
from vla_deploy.safety.surroundings import ZoneFinding
from vla_deploy.safety.zones import (
    IDLE,
    Footprint,
    Motion,
    Points,
    Trigger,
    braking_m,
    judge_zone,
)


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
        self._triggers: dict[str, Trigger] = {}
        self._stands = False
        self._reach_m = max((reach_m(robot, zone) for zone in self._zones), default=0.0)

    @property
    def scan_age_s(self) -> float | None:
        """Return the age of the last scan, None before the first."""
        return self._nearby[ZoneSource.LIDAR].age_s

    @property
    def depth_age_s(self) -> float | None:
        """Return the age of what the depth camera told last, None before the first."""
        return self._nearby[ZoneSource.DEPTH].age_s

    def look(self, now_ns: int, position: Floats, motion: Motion) -> None:
        """Judge all zones; nothing new around a base that stands leaves them as they were."""
        points: dict[ZoneSource, Points] = {
            source: _within(nearby.points(now_ns, position, motion), self._reach_m)
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

    def _judge(self, points: dict[ZoneSource, Points], motion: Motion) -> list[ZoneFinding]:
        found = []
        for zone in self._zones:
            trigger, finding = judge_zone(
                zone,
                self._triggers.get(zone.name, IDLE),
                np.concatenate([points[source] for source in zone.sources]),
                self._footprint,
                motion,
                fresh=any(self._nearby[source].fresh for source in zone.sources),
            )
            self._triggers[zone.name] = trigger
            if finding is not None:
                found.append(finding)
        return found


def reach_m(robot: RobotDescription, zone: Zone) -> float:
    """Return how far from the base's centre a point can matter to a zone."""
    base = robot.base
    top = Motion(
        v_m_s=base.max_speed_m_s, w_rad_s=0.0, deceleration_m_s2=base.max_acceleration_m_s2
    )
    corners_m = (float(np.hypot(x, y)) for x, y in zone.polygon_m)
    corner_m = max(corners_m, default=base.footprint_radius_m)
    driven_m = base.max_speed_m_s * zone.time_before_collision_s
    return corner_m + max(driven_m, braking_m(top, zone.reaction_s or 0.0))


def _within(points: Points, reach_m: float) -> Points:
    near: Points = points[(points**2).sum(axis=1) <= reach_m**2]
    return near
