"""Know the robot's surroundings as numbers for the safety judge, cheaply enough for every tick.

Each part has a rate of its own and a tick works on at most one of them, the one most overdue, so
that no tick carries all the geometry.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from drivers.clock import NS_PER_S
from vla_deploy.control.axes import Floats
from vla_deploy.control.body_shapes import BodyShapes, Survey
from vla_deploy.control.contact_torque import ContactTorque
from vla_deploy.control.nearby import Nearby
from vla_deploy.control.setpoint_rates import SetpointRates
from vla_deploy.ipc import BY_NAME, SharedSpace
from vla_deploy.robots import RobotDescription
from vla_deploy.robots.model import RobotModel
from vla_deploy.robots.protection import Zone, ZoneSource
from vla_deploy.safety.balance import tip_margin_ratio
from vla_deploy.safety.clearance import (
    JointBounds,
    JointMotion,
    Stopping,
    beyond_box,
    least_distances,
    nearest_pair,
    stopping,
)
from vla_deploy.safety.keep_out import judge_keep_out, seen_from
from vla_deploy.safety.surroundings import NOTHING_KNOWN, Surroundings, ZoneFinding
from vla_deploy.safety.zones import (
    IDLE,
    Footprint,
    Motion,
    Points,
    Trigger,
    braking_m,
    judge_zone,
)

# From one look ahead to the next one's first braking setpoint.
ARM_REACTION_S = 0.024
# Beyond this a joint, in rad of its servo, does not do as its setpoint says.
_FOLLOWS_RAD = 0.15
BASE_REACTION_S = 0.1
# Of each new sample, 10 times a second: a low-pass of 0.1 s.
_IMU_SHARE = 0.5
_MAX_POSE_AGE_NS = round(BY_NAME["pose"].deadline_s * NS_PER_S)
_MAX_IMU_AGE_NS = round(BY_NAME["imu"].deadline_s * NS_PER_S)


@dataclass(slots=True)
class _Body:
    """Hold what a tick tells of joints and base."""

    now_ns: int
    position: Floats
    velocity: Floats
    effort_ratio: Floats
    setpoint: Floats
    motion: Motion


@dataclass(slots=True)
class _Part:
    """Hold one part's work and when it is due."""

    work: Callable[[_Body], None]
    period_ns: int
    due_ns: int = 0


class SurroundingsWatch:
    """Refresh what is known of zones, clearances, balance and contact, a part at a time."""

    def __init__(self, space: SharedSpace, robot: RobotDescription) -> None:
        """Read the robot's shapes; topics may come later."""
        self._robot = robot
        self._known = NOTHING_KNOWN
        self._body = BodyShapes(robot)
        model = RobotModel(robot)
        self._contact = ContactTorque(robot, model)
        self._footprint = Footprint(corners_m=((0.0, 0.0),), radius_m=robot.base.footprint_radius_m)
        self._nearby = {
            source: Nearby(source, space, robot, model, self._body) for source in ZoneSource
        }
        self._triggers: dict[str, Trigger] = {}
        self._stands = False
        self._reach_m = max((self._reach_of(zone) for zone in robot.protection.zones), default=0.0)
        self._pose = space.cell_reader("pose")
        self._imu = space.cell_reader("imu")
        self._acceleration: Floats | None = None
        self._areas = {
            area.name: np.array(area.polygon_m, dtype=np.float64) for area in robot.home.zones
        }
        boxes = robot.protection.workspaces
        self._workspaces = tuple(boxes)
        self._box_low = np.array([box.min_m for box in boxes.values()]).reshape(-1, 3)
        self._box_high = np.array([box.max_m for box in boxes.values()]).reshape(-1, 3)
        self._bounds = JointBounds(
            lower=robot.position_min,
            upper=robot.position_max,
            velocity=robot.velocity_max,
            acceleration=robot.acceleration_max,
            jerk=robot.jerk_max,
            following=np.array(
                [_FOLLOWS_RAD * servo.travel_per_rad for servo in robot.servo_bus.servos]
            ),
            reaction_s=ARM_REACTION_S,
        )
        self._ahead: tuple[Stopping, Survey] | None = None
        self._self_m = robot.protection.clearance.self_m
        self._floor_m = robot.protection.clearance.floor_m
        self._self_least = np.full(len(self._body.self_pairs), self._self_m)
        self._floor_least = np.full(len(self._body.floor_pairs), self._floor_m)
        self._setpoints = SetpointRates()
        self._parts = [_Part(work, NS_PER_S // rate_hz) for work, rate_hz in self._declared_rates()]

    def _declared_rates(self) -> tuple[tuple[Callable[[_Body], None], int], ...]:
        return (
            (self._look_at_contact, 50),
            (self._look_ahead, 50),
            (self._look_at_zones, 25),
            (self._look_at_keep_out, 10),
            (self._look_at_balance, 10),
        )

    def refresh(
        self,
        now_ns: int,
        position: Floats,
        velocity: Floats,
        effort_ratio: Floats,
        setpoint: Floats,
        v_m_s: float,
        w_rad_s: float,
        powered: bool,
    ) -> Surroundings:
        """Do the part that is most overdue, if any, and return all that is known.

        `powered` tells whether every joint is: before that, parts may lie against each other.
        """
        if self._ahead is not None:
            self._look_at_clearance(powered)
            return self._known
        part = min(self._parts, key=lambda one: one.due_ns)
        if now_ns >= part.due_ns and np.isfinite(position).all() and np.isfinite(velocity).all():
            part.due_ns = max(part.due_ns, now_ns - part.period_ns) + part.period_ns
            deceleration = self._robot.base.max_acceleration_m_s2
            motion = Motion(v_m_s=v_m_s, w_rad_s=w_rad_s, deceleration_m_s2=deceleration)
            part.work(_Body(now_ns, position, velocity, effort_ratio, setpoint, motion))
        return self._known

    def close(self) -> None:
        """Unmap the topics."""
        for nearby in self._nearby.values():
            nearby.close()
        self._pose.close()
        self._imu.close()

    def _look_at_contact(self, body: _Body) -> None:
        torque = self._contact.update(body.now_ns, body.position, body.velocity, body.effort_ratio)
        self._known = replace(self._known, external_torque_nm=torque)

    def _look_ahead(self, body: _Body) -> None:
        """Measure where the joints come to rest; the next tick measures from where."""
        velocity, acceleration = self._setpoints.rates(body.now_ns, body.setpoint)
        motion = JointMotion(
            position=body.position,
            velocity=body.velocity,
            setpoint=body.setpoint,
            setpoint_velocity=velocity,
            setpoint_acceleration=acceleration,
        )
        ahead = stopping(motion, self._bounds)
        self._ahead = ahead, self._body.survey(ahead.position)

    def _look_at_clearance(self, powered: bool) -> None:
        assert self._ahead is not None, "the caller has looked ahead"
        (ahead, there), self._ahead = self._ahead, None
        body, time_s = self._body, ahead.time_s
        here = body.survey(ahead.start)
        self._self_least = least_distances(self._self_least, here.self_m, self._self_m, powered)
        self._floor_least = least_distances(self._floor_least, here.floor_m, self._floor_m, powered)
        self._known = replace(
            self._known,
            self_clearance=nearest_pair(
                body.self_pairs, here.self_m, there.self_m, self._self_least, time_s
            ),
            environment_clearance=nearest_pair(
                body.floor_pairs, here.floor_m, there.floor_m, self._floor_least, time_s
            ),
            workspace=beyond_box(
                self._workspaces,
                here.grips,
                there.grips,
                self._box_low,
                self._box_high,
                time_s,
            ),
        )

    def _look_at_zones(self, body: _Body) -> None:
        points: dict[ZoneSource, Points] = {
            source: _within(nearby.points(body.now_ns, body.position, body.motion), self._reach_m)
            for source, nearby in self._nearby.items()
        }
        stood, self._stands = self._stands, body.motion.stands
        nothing_new = stood and self._stands and not any(n.fresh for n in self._nearby.values())
        zones = self._known.zones if nothing_new else self._zone_findings(points, body.motion)
        self._known = replace(
            self._known,
            zones=tuple(zones),
            scan_age_s=self._nearby[ZoneSource.LIDAR].age_s,
            depth_age_s=self._nearby[ZoneSource.DEPTH].age_s,
        )

    def _reach_of(self, zone: Zone) -> float:
        """Return how far from the base's centre a point can matter to a zone."""
        base, footprint = self._robot.base, self._robot.base.footprint_radius_m
        top = Motion(
            v_m_s=base.max_speed_m_s, w_rad_s=0.0, deceleration_m_s2=base.max_acceleration_m_s2
        )
        corner_m = max((float(np.hypot(x, y)) for x, y in zone.polygon_m), default=footprint)
        driven_m = base.max_speed_m_s * zone.time_before_collision_s
        return corner_m + max(driven_m, braking_m(top, zone.reaction_s or 0.0))

    def _zone_findings(self, points: dict[ZoneSource, Points], motion: Motion) -> list[ZoneFinding]:
        found = []
        for zone in self._robot.protection.zones:
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

    def _look_at_keep_out(self, body: _Body) -> None:
        sample = self._pose.latest()
        keep_out = None
        if sample is not None and body.now_ns - sample.stamp_ns <= _MAX_POSE_AGE_NS:
            x_m, y_m, yaw_rad = (float(sample.data[n]) for n in ("x_m", "y_m", "yaw_rad"))
            areas = {name: seen_from(area, x_m, y_m, yaw_rad) for name, area in self._areas.items()}
            keep_out = judge_keep_out(areas, self._footprint, body.motion, BASE_REACTION_S)
        self._known = replace(self._known, keep_out=keep_out)

    def _look_at_balance(self, body: _Body) -> None:
        tip_over, sample = self._robot.protection.tip_over, self._imu.latest()
        if tip_over is None or sample is None:
            return
        if body.now_ns - sample.stamp_ns > _MAX_IMU_AGE_NS:
            self._acceleration = None
            self._known = replace(self._known, tip_margin_ratio=None)
            return
        measured = np.array(sample.data["acceleration_m_s2"], dtype=np.float64)
        last = measured if self._acceleration is None else self._acceleration
        self._acceleration = last + _IMU_SHARE * (measured - last)
        ratio = tip_margin_ratio(
            self._body.centre_of_mass(body.position),
            self._acceleration,
            np.array(tip_over.support_m),
            tip_over.max_lean_rad,
        )
        self._known = replace(self._known, tip_margin_ratio=ratio)


def _within(points: Points, reach_m: float) -> Points:
    near: Points = points[(points**2).sum(axis=1) <= reach_m**2]
    return near
