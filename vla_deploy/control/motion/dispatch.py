"""Turn motion commands into motions, or into refusals that say why."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from vla_deploy.control.judging.thresholds import contact_torque
from vla_deploy.control.motion.axes import AxisLimits, Floats
from vla_deploy.control.motion.commands import (
    Cancel,
    CommandRefused,
    JointGoal,
    RestAsked,
    Waypoints,
    motion_id_of,
    parse_command,
)
from vla_deploy.control.motion.motions import Ending, MotionResult, MotionSet
from vla_deploy.control.motion.profile_motion import plan_motion
from vla_deploy.control.motion.touch_guard import TouchGuard
from vla_deploy.control.motion.trajectory import TrajectoryRefused, plan_trajectory
from vla_deploy.control.output.servos import ServoLine
from vla_deploy.robots import RobotDescription

_START_TOLERANCE_RAD = 0.05
_ROUNDING = 1e-6


def axis_limits(robot: RobotDescription) -> AxisLimits:
    """Return every joint's motion limits."""
    return AxisLimits(
        velocity=robot.velocity_max, acceleration=robot.acceleration_max, jerk=robot.jerk_max
    )


def start_tolerance(robot: RobotDescription) -> Floats:
    """Return how far from its setpoint each joint's trajectory may begin."""
    return _START_TOLERANCE_RAD * np.array(
        [servo.travel_per_rad for servo in robot.servo_bus.servos]
    )


class Dispatcher:
    """Start, replace and cancel motions on request."""

    def __init__(self, robot: RobotDescription, motions: MotionSet, servos: ServoLine) -> None:
        self._index = robot.joint_index
        self._names = np.array(robot.joint_names)
        self._limits = axis_limits(robot)
        self._lower, self._upper = robot.position_min, robot.position_max
        self._start_tolerance = start_tolerance(robot)
        self._contact_nm = contact_torque(robot)
        self._motions = motions
        self._servos = servos
        self.rest_source: str | None = None
        """Who asked since the last tick that all comes to rest."""

    def take_rest(self) -> str | None:
        """Return once who asked that all comes to rest, or None."""
        source, self.rest_source = self.rest_source, None
        return source

    def handle(self, payload: Mapping[str, Any], refusal: str) -> list[MotionResult]:
        """Carry out one command, unless there is a reason to refuse all, and return what ended."""
        try:
            return self._carry_out(payload, refusal)
        except (CommandRefused, TrajectoryRefused) as error:
            motion_id = motion_id_of(payload)
            if motion_id is None:
                return []
            return [MotionResult(motion_id=motion_id, ending=Ending.REFUSED, reason=str(error))]

    def _carry_out(self, payload: Mapping[str, Any], refusal: str) -> list[MotionResult]:
        command = parse_command(payload, self._index)
        if isinstance(command, Cancel):
            return self._motions.cancel(command.motion_id)
        if isinstance(command, RestAsked):
            self.rest_source = command.source
            return []
        if refusal:
            raise CommandRefused(refusal)
        if isinstance(command, JointGoal):
            return self._start_goal(command)
        return self._start_waypoints(command)

    def _start_goal(self, goal: JointGoal) -> list[MotionResult]:
        self._check_range(goal)
        efforts = {int(axis): goal.effort_ratio.get(int(axis), 1.0) for axis in goal.axes}
        if not self._servos.limit_effort(efforts):
            raise CommandRefused(self._servos.failure)
        limits = self._limits.of(goal.axes).scaled(goal.speed_ratio)
        start = self._motions.state.of(goal.axes)
        curve = plan_motion(start, goal.target, limits, together=goal.together)
        return self._motions.start(goal.motion_id, goal.axes, curve)

    def _start_waypoints(self, command: Waypoints) -> list[MotionResult]:
        axes = command.axes
        curve = plan_trajectory(
            command.joints,
            command.times_s,
            command.positions,
            self._motions.state.of(axes),
            self._limits.of(axes),
            (self._lower[axes], self._upper[axes]),
            self._start_tolerance[axes],
        )
        return self._motions.start(command.motion_id, axes, curve, self._guard(command))

    def _guard(self, command: Waypoints) -> TouchGuard | None:
        if command.contact_ratio is None:
            return None
        most_nm = command.contact_ratio * self._contact_nm[command.axes]
        return TouchGuard(command.joints, most_nm)

    def _check_range(self, goal: JointGoal) -> None:
        lower, upper = self._lower[goal.axes], self._upper[goal.axes]
        outside = (goal.target < lower - _ROUNDING) | (goal.target > upper + _ROUNDING)
        if outside.any():
            worst = int(outside.argmax())
            raise CommandRefused(
                f"{self._names[goal.axes[worst]]}: target {goal.target[worst]:.4g}, allowed "
                f"{lower[worst]:.4g} to {upper[worst]:.4g}"
            )
