"""Prove by control's own measurements that a stop has ended in standstill, and in time."""

from collections.abc import Mapping
from typing import Final

import numpy as np

from drivers.clock import NS_PER_S
from vla_deploy.control.motion.axes import Floats, stopping
from vla_deploy.control.motion.base_motion import base_limits
from vla_deploy.control.motion.dispatch import axis_limits
from vla_deploy.control.output.base_drive import BaseDrive
from vla_deploy.control.output.servos import ServoLine
from vla_deploy.control.output.wheels import BRAKE_NS
from vla_deploy.ipc.payloads.motion import StopRecord, StopStateName
from vla_deploy.robots import RobotDescription
from vla_deploy.robots.description import StopCategory
from vla_deploy.safety import SafetyLimits

ASKED_TO_REST: Final = "stop"
"""The cause where an operator's `stop` brings all to rest, and no rule does."""
CONFIRM_NS: Final = NS_PER_S // 10
"""Standstill counts once it has lasted that long: over as long a time wheels are judged, too."""
SETTLE_S: Final = 0.5
"""Joints and wheels under load follow their setpoints to rest within this time."""


class StopProof:
    """Follow the last stop to standstill; between stops it does nothing.

    Speeds below the limits of `standstill_motion` count, and positions must agree: a servo or a
    drive that tells no speed while its encoder counts on has not stopped. What is not measured does
    not stand.
    """

    def __init__(
        self, robot: RobotDescription, limits: SafetyLimits, servos: ServoLine, wheels: BaseDrive
    ) -> None:
        self._servos = servos
        self._wheels = wheels
        self._servo_age_s = limits.servo_age_s
        self._parts = (*robot.joint_names, *robot.wheel_joints)
        self._units = [
            *("m/s" if one.travel_per_rad != 1.0 else "rad/s" for one in robot.servo_bus.servos),
            *("rad/s" for _ in robot.wheel_joints),
        ]
        wheel_limits = np.full(len(robot.wheel_joints), limits.standstill_wheel_rad_s)
        self._limits = np.concatenate([limits.standstill_velocity, wheel_limits])
        self._allowed_by_category_s = allowed_times_s(robot)
        self._allowed_asked_s = base_limits(robot).slowing_s + SETTLE_S
        self._number = 0
        self._state: StopStateName = "verified"
        self._cause = self._source = self._reason = ""
        self._category = StopCategory.STOP_KEEP_POWER
        self._allowed_s = 0.0
        self._begun_ns = 0
        self._standstill_s: float | None = None
        self._still_since_ns: int | None = None
        self._still_at = np.zeros(0)

    @property
    def under_way(self) -> bool:
        """Return whether a stop waits for its verdict."""
        return self._state == "in_progress"

    @property
    def news(self) -> tuple[int, StopStateName]:
        """Return what nobody may learn late."""
        return self._number, self._state

    def begin(self, now_ns: int, cause: str, source: str, category: StopCategory) -> None:
        """Follow a stop from now on, in place of the one before."""
        self._number += 1
        self._state = "in_progress"
        self._cause, self._source, self._reason = cause, source, ""
        self._category = category
        self._allowed_s = self._allowed_by_category_s[category]
        if cause == ASKED_TO_REST:  # the base slows down as in its work
            self._allowed_s = max(self._allowed_s, self._allowed_asked_s)
        self._begun_ns = now_ns
        self._standstill_s = self._still_since_ns = None

    def step(self, now_ns: int) -> None:
        """Look at this tick's measurements; call it while a stop is under way."""
        moves = self._unmeasured() or self._motion(now_ns)
        if not moves:
            self._rest(now_ns)
            return
        self._still_since_ns = None
        elapsed_s = (now_ns - self._begun_ns) / NS_PER_S
        if elapsed_s > self._allowed_s:
            self.fail(f"{moves}, {elapsed_s:.2f} s after the stop began")

    def fail(self, reason: str) -> None:
        """End a stop that is under way as failed."""
        self._state, self._reason = "failed", reason

    def document(self, now_ns: int) -> StopRecord | None:
        """Return the record of the last stop; None before the first."""
        if not self._number:
            return None
        return {
            "number": self._number,
            "state": self._state,
            "cause": self._cause,
            "source": self._source,
            "category": self._category.value,
            "begun_ns": self._begun_ns,
            "age_s": round((now_ns - self._begun_ns) / NS_PER_S, 1),
            "allowed_s": round(self._allowed_s, 3),
            "standstill_s": self._standstill_s,
            "reason": self._reason,
        }

    def _rest(self, now_ns: int) -> None:
        if self._still_since_ns is None:
            self._still_since_ns, self._still_at = now_ns, self._places()
        elif now_ns - self._still_since_ns >= CONFIRM_NS:
            self._state = "verified"
            self._standstill_s = round((self._still_since_ns - self._begun_ns) / NS_PER_S, 4)

    def _unmeasured(self) -> str:
        """Return which part gives no fresh values, or nothing."""
        age_s, wheels = self._servos.state.age_s, self._wheels
        if not (age_s <= self._servo_age_s).all():
            worst = int(age_s.argmax())
            return (
                f"{self._parts[worst]} is not measured: its last value is {age_s[worst]:.2f} s old"
            )
        if wheels.has_wheels and (wheels.lost or wheels.state is None):
            return f"wheels are not measured: {wheels.name} is lost"
        return ""

    def _motion(self, now_ns: int) -> str:
        """Return which part moves, by its speed or by how far it got since all seemed at rest."""
        speeds = np.abs(self._speeds())
        if self._still_since_ns is not None:
            since_s = max(now_ns - self._still_since_ns, CONFIRM_NS) / NS_PER_S
            speeds = np.maximum(speeds, np.abs(self._places() - self._still_at) / since_s)
        over = speeds - self._limits
        worst = int(over.argmax())
        if over[worst] <= 0.0:
            return ""
        unit = self._units[worst]
        speed = f"{speeds[worst]:.3g} {unit}, limit {self._limits[worst]:.3g} {unit}"
        return f"{self._parts[worst]} still moved at {speed}"

    def _speeds(self) -> Floats:
        wheels = self._wheels.state
        joints = self._servos.state.velocity_rad_s
        return joints if wheels is None else np.concatenate([joints, wheels.velocity_rad_s])

    def _places(self) -> Floats:
        wheels = self._wheels.state
        joints = self._servos.state.position_rad
        return joints.copy() if wheels is None else np.concatenate([joints, wheels.position_rad])


def allowed_times_s(robot: RobotDescription) -> Mapping[StopCategory, float]:
    """Return within which time a stop of each category must have led to standstill.

    That is the longest ramp from top speed, and the time to settle. Where a drive brakes by itself,
    or coasts without power, it has as long as it is given before its power goes.
    """
    limits = axis_limits(robot)
    joints_s = float(stopping(limits.velocity, limits)[0].max(initial=0.0))
    ramp_s = max(joints_s, base_limits(robot).braking_s)
    braked_s = max(ramp_s, BRAKE_NS / NS_PER_S)
    return {
        StopCategory.POWER_REMOVED: braked_s + SETTLE_S,
        StopCategory.STOP_THEN_REMOVE_POWER: braked_s + SETTLE_S,
        StopCategory.STOP_KEEP_POWER: ramp_s + SETTLE_S,
    }
