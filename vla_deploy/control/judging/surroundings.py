"""Know the robot's surroundings as numbers for the safety judge, cheaply enough for every tick.

Each part has a rate of its own and a tick works on at most one of them, the one most overdue, so
that no tick carries all the geometry.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from drivers.clock import NS_PER_S
from vla_deploy.control.judging.body_shapes import BodyShapes
from vla_deploy.control.judging.clearance_watch import ClearanceWatch
from vla_deploy.control.judging.contact_torque import ContactTorque
from vla_deploy.control.judging.thresholds import IMU_AGE_S, POSE_AGE_S
from vla_deploy.control.judging.zone_watch import ZoneWatch
from vla_deploy.control.motion.axes import Floats, all_of
from vla_deploy.control.motion.base_velocity import BaseVelocity
from vla_deploy.ipc import SharedSpace, topics
from vla_deploy.robots import RobotDescription
from vla_deploy.robots.kinematics.model import RobotModel
from vla_deploy.safety.balance import tip_margin_ratio
from vla_deploy.safety.keep_out import judge_keep_out, seen_from
from vla_deploy.safety.surroundings import NOTHING_KNOWN, Surroundings
from vla_deploy.safety.zones import BaseMotion, Footprint, braking_m

BASE_REACTION_S = 0.1
# Of each new sample, 10 times a second: a low-pass of 0.1 s.
_IMU_SHARE = 0.5


@dataclass(slots=True)
class _Body:
    """Hold what a tick tells of joints and base."""

    now_ns: int
    position: Floats
    velocity: Floats
    setpoint: Floats
    motion: BaseMotion


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
        base, home = robot.parts.base, robot.parts.home
        self._deceleration_m_s2 = base.max_acceleration_m_s2 if base else 0.0
        radius_m = base.footprint_radius_m if base else 0.0
        self._footprint = Footprint(corners_m=((0.0, 0.0),), radius_m=radius_m)
        self._zones = ZoneWatch(space, robot, model, self._body, self._footprint)
        self._clearance = ClearanceWatch(robot, self._body)
        self._pose = space.cell_reader(topics.POSE)
        self._imu = space.cell_reader(topics.IMU)
        self._acceleration: Floats | None = None
        self._areas = {
            area.name: np.array(area.polygon_m, dtype=np.float64)
            for area in (home.zones if home else ())
        }
        self._middles = {name: _around(area) for name, area in self._areas.items()}
        self._parts = [_Part(work, NS_PER_S // rate_hz) for work, rate_hz in self._declared_rates()]

    def _declared_rates(self) -> tuple[tuple[Callable[[_Body], None], int], ...]:
        arms = ((self._look_at_contact, 50), (self._look_ahead, 50))
        if self._robot.parts.base is None:
            return arms
        return (
            *arms,
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
        velocity_of_base: BaseVelocity,
        powered: bool,
    ) -> Surroundings:
        """Do the part that is most overdue, if any, and return all that is known.

        `powered` tells whether every joint is: before that, parts may lie against each other.
        """
        self._contact.note(velocity, effort_ratio)
        if self._clearance.has_looked_ahead:
            self._look_at_clearance(powered)
            return self._known
        part = min(self._parts, key=lambda one: one.due_ns)
        if now_ns >= part.due_ns and _is_known(position) and _is_known(velocity):
            part.due_ns = max(part.due_ns, now_ns - part.period_ns) + part.period_ns
            motion = BaseMotion(
                v_m_s=velocity_of_base.v_m_s,
                w_rad_s=velocity_of_base.w_rad_s,
                deceleration_m_s2=self._deceleration_m_s2,
            )
            part.work(_Body(now_ns, position, velocity, setpoint, motion))
        return self._known

    def close(self) -> None:
        """Unmap the topics."""
        self._zones.close()
        self._pose.close()
        self._imu.close()

    def _look_at_contact(self, body: _Body) -> None:
        torque = self._contact.update(body.now_ns, body.position)
        self._known = replace(self._known, external_torque_nm=torque)

    def _look_ahead(self, body: _Body) -> None:
        """Look where the joints come to rest; the next tick compares with where they are."""
        self._clearance.look_ahead(body.now_ns, body.position, body.velocity, body.setpoint)

    def _look_at_clearance(self, powered: bool) -> None:
        clearance = self._clearance
        if clearance.compare(powered):
            self._known = replace(
                self._known,
                self_clearance=clearance.self_clearance,
                environment_clearance=clearance.environment_clearance,
                workspace=clearance.workspace,
            )

    def _look_at_zones(self, body: _Body) -> None:
        zones = self._zones
        zones.look(body.now_ns, body.position, body.motion)
        self._known = replace(
            self._known,
            zones=zones.findings,
            scan_age_s=zones.scan_age_s,
            depth_age_s=zones.depth_age_s,
            depth_due_s=zones.depth_due_s,
        )

    def _look_at_keep_out(self, body: _Body) -> None:
        sample = self._pose.latest()
        if sample is None:
            return
        keep_out, age_s = None, sample.age_s(body.now_ns)
        if age_s <= POSE_AGE_S:
            x_m, y_m, yaw_rad = (float(sample.data[n]) for n in ("x_m", "y_m", "yaw_rad"))
            near = self._areas_near(x_m, y_m, body.motion)
            areas = {name: seen_from(area, x_m, y_m, yaw_rad) for name, area in near}
            keep_out = judge_keep_out(areas, self._footprint, body.motion, BASE_REACTION_S)
        self._known = replace(self._known, keep_out=keep_out, pose_age_s=age_s)

    def _areas_near(self, x_m: float, y_m: float, motion: BaseMotion) -> list[tuple[str, Floats]]:
        """Leave out the areas that the footprint cannot be in before it stands."""
        around_m = self._footprint.radius_m + braking_m(motion, BASE_REACTION_S)
        return [
            (name, area)
            for name, area in self._areas.items()
            if math.hypot(self._middles[name][0] - x_m, self._middles[name][1] - y_m)
            <= self._middles[name][2] + around_m
        ]

    def _look_at_balance(self, body: _Body) -> None:
        tip_over, sample = self._robot.protection.tip_over, self._imu.latest()
        if tip_over is None or sample is None:
            return
        age_s = sample.age_s(body.now_ns)
        if age_s > IMU_AGE_S:
            self._acceleration = None
            self._known = replace(self._known, tip_margin_ratio=None, imu_age_s=age_s)
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
        self._known = replace(self._known, tip_margin_ratio=ratio, imu_age_s=age_s)


def _around(area: Floats) -> tuple[float, float, float]:
    """Return a circle around a polygon: middle and radius."""
    x_m, y_m = area.mean(axis=0).tolist()
    return x_m, y_m, float(np.hypot(area[:, 0] - x_m, area[:, 1] - y_m).max())


def _is_known(values: Floats) -> bool:
    return all_of(np.isfinite(values))
