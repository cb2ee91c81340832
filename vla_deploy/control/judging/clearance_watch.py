"""Measure how near the robot's parts come to each other and to the floor where they will rest."""

import numpy as np

from vla_deploy.control.judging.body_shapes import BodyShapes, Survey
from vla_deploy.control.motion.axes import Floats
from vla_deploy.control.motion.setpoint_rates import SetpointRates
from vla_deploy.robots import RobotDescription
from vla_deploy.safety.clearance import (
    JointBounds,
    JointMotion,
    StoppingMotion,
    beyond_box,
    least_distances,
    nearest_pair,
    stopping,
)
from vla_deploy.safety.surroundings import Clearance, Excess

# From one look ahead to the next one's first braking setpoint.
ARM_REACTION_S = 0.024
# Beyond this a joint, in rad of its servo, does not do as its setpoint says.
_FOLLOWS_RAD = 0.15


class ClearanceWatch:
    """Look ahead in one tick, and compare with where the joints are in the next."""

    def __init__(self, robot: RobotDescription, body: BodyShapes) -> None:
        self.self_clearance: Clearance | None = None
        self.environment_clearance: Clearance | None = None
        self.workspace: Excess | None = None
        self._body = body
        boxes = robot.protection.workspaces
        self._workspaces = tuple(boxes)
        self._box_low = np.array([box.min_m for box in boxes.values()]).reshape(-1, 3)
        self._box_high = np.array([box.max_m for box in boxes.values()]).reshape(-1, 3)
        self._bounds = joint_bounds(robot)
        self._ahead: tuple[StoppingMotion, Survey] | None = None
        self._compared: tuple[int, int, float, bool] | None = None
        self._surveys: tuple[Survey, Survey] | None = None
        self._self_m = robot.protection.clearance.self_m
        self._floor_m = robot.protection.clearance.floor_m
        self._self_least = np.full(len(body.self_pairs), self._self_m)
        self._floor_least = np.full(len(body.floor_pairs), self._floor_m)
        self._setpoints = SetpointRates()

    @property
    def has_looked_ahead(self) -> bool:
        """Return whether `compare` has something to compare with."""
        return self._ahead is not None

    def look_ahead(self, now_ns: int, position: Floats, velocity: Floats, setpoint: Floats) -> None:
        """Measure where the joints come to rest."""
        setpoint_velocity, setpoint_acceleration = self._setpoints.rates(now_ns, setpoint)
        motion = JointMotion(
            position=position,
            velocity=velocity,
            setpoint=setpoint,
            setpoint_velocity=setpoint_velocity,
            setpoint_acceleration=setpoint_acceleration,
        )
        ahead = stopping(motion, self._bounds)
        self._ahead = ahead, self._body.survey(ahead.position)

    def compare(self, powered: bool) -> bool:
        """Measure from where the joints go there, and find what has the least to spare.

        `powered` tells whether every joint is: before that, parts may lie against each other.
        Return whether there may be news; a robot that stands in the same pose makes none.
        """
        assert self._ahead is not None, "the caller has looked ahead"
        (ahead, there), self._ahead = self._ahead, None
        here = self._body.survey(ahead.start)
        before, self._compared = self._compared, (id(here), id(there), ahead.time_s, powered)
        if before == self._compared:
            return False
        self._surveys = here, there  # keeps their identities theirs
        self._find_least(here, there, ahead.time_s, powered)
        return True

    def _find_least(self, here: Survey, there: Survey, time_s: float, powered: bool) -> None:
        body = self._body
        self._self_least = least_distances(self._self_least, here.self_m, self._self_m, powered)
        self._floor_least = least_distances(self._floor_least, here.floor_m, self._floor_m, powered)
        self.self_clearance = nearest_pair(
            body.self_pairs, here.self_m, there.self_m, self._self_least, time_s
        )
        self.environment_clearance = nearest_pair(
            body.floor_pairs, here.floor_m, there.floor_m, self._floor_least, time_s
        )
        self.workspace = beyond_box(
            self._workspaces, here.grips, there.grips, self._box_low, self._box_high, time_s
        )


def joint_bounds(robot: RobotDescription) -> JointBounds:
    """Return what bounds the joints' way to standstill."""
    travel = np.array([servo.travel_per_rad for servo in robot.servo_bus.servos])
    return JointBounds(
        lower=robot.position_min,
        upper=robot.position_max,
        velocity=robot.velocity_max,
        acceleration=robot.acceleration_max,
        jerk=robot.jerk_max,
        following=_FOLLOWS_RAD * travel,
        reaction_s=ARM_REACTION_S,
    )
