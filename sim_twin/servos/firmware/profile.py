"""Lead the setpoint to the goal along the servo's velocity profile, for all servos at once.

Source: ROBOTIS e-manual XM430-W350, "What is the Profile": profile velocity 0 is a step, profile
acceleration 0 a rectangle, both set a trapezoid. With bit 2 of the drive mode both are times in ms.
"""

from typing import Final

import numpy as np
from numpy.typing import NDArray

from drivers.dynamixel.tables.control_table import PULSES_PER_REV
from sim_twin.servos.firmware.columns import TableColumns

PULSES_S_PER_UNIT: Final = 0.229 * PULSES_PER_REV / 60
PULSES_S2_PER_UNIT: Final = 214.577 * PULSES_PER_REV / 3600
TIME_BASED: Final = 0x04
UNBOUNDED: Final = 1e12

Floats = NDArray[np.float64]


class SetpointProfile:
    """Lead each servo's setpoint to its goal in a trapezoid of speed, in its own units."""

    def __init__(self, count: int) -> None:
        self.position = np.zeros(count)
        self.velocity = np.zeros(count)
        self._speed = np.full(count, UNBOUNDED)
        self._acceleration = np.full(count, UNBOUNDED)
        self.active = False
        """Whether any setpoint is bounded in speed or acceleration."""

    def limit(self, speed: Floats, acceleration: Floats) -> None:
        """Take over what bounds the setpoints; `UNBOUNDED` lets one step to its goal."""
        self._speed, self._acceleration = speed, acceleration
        self.active = bool((speed < UNBOUNDED).any() or (acceleration < UNBOUNDED).any())

    def restart(self, rows: NDArray[np.bool_] | int, position: Floats | float) -> None:
        """Begin anew at rest at `position`."""
        self.position[rows] = position
        self.velocity[rows] = 0.0

    def lead(self, goal: Floats | NDArray[np.int32], dt_s: float) -> None:
        """Move every setpoint on by one step."""
        if not self.active:
            self.position[:] = goal
            return
        distance = goal - self.position
        braking = np.sqrt(2.0 * self._acceleration * np.abs(distance))
        wanted = np.copysign(np.minimum(self._speed, braking), distance)
        change = self._acceleration * dt_s
        velocity = np.clip(wanted, self.velocity - change, self.velocity + change)
        step = velocity * dt_s
        arrives = (np.abs(distance) <= np.abs(step)) & (distance * velocity >= 0.0)
        self.velocity = np.where(arrives, 0.0, velocity)
        self.position = np.where(arrives, goal, self.position + step)


class TrajectoryProfile(SetpointProfile):
    """Hold the trajectory of each Dynamixel servo in pulses and pulses per second."""

    def __init__(self, columns: TableColumns) -> None:
        super().__init__(len(columns.goal_position))
        self._columns = columns

    def reload(self) -> None:
        """Take over profile registers that the host or the firmware changed."""
        columns = self._columns
        by_speed = (columns.drive_mode & TIME_BASED) == 0
        units = np.minimum(columns.profile_velocity, columns.velocity_limit)
        speed = np.where(units > 0, units * PULSES_S_PER_UNIT, UNBOUNDED)
        stepped = (columns.profile_acceleration == 0) | (units == 0)
        ramp = columns.profile_acceleration * PULSES_S2_PER_UNIT
        acceleration = np.where(stepped, UNBOUNDED, ramp)
        self._speed = np.where(by_speed, speed, self._speed)
        self._acceleration = np.where(by_speed, acceleration, self._acceleration)
        self.active = bool((self._speed < UNBOUNDED).any())

    def on_goal(self, row: int) -> None:
        """Turn a time-based profile into speeds for the distance that a new goal asks for."""
        columns = self._columns
        if not columns.drive_mode[row] & TIME_BASED:
            return
        span_s = float(columns.profile_velocity[row]) / 1e3
        ramp_s = min(float(columns.profile_acceleration[row]) / 1e3, span_s / 2)
        distance = abs(float(columns.goal_position[row]) - float(self.position[row]))
        speed = distance / (span_s - ramp_s) if span_s > 0 else UNBOUNDED
        self._speed[row] = max(speed, 1.0)
        self._acceleration[row] = max(speed, 1.0) / ramp_s if ramp_s > 0 else UNBOUNDED
        self.active = bool((self._speed < UNBOUNDED).any())

    def advance(self, dt_s: float) -> None:
        """Move every setpoint on by one step."""
        self.lead(self._columns.goal_position, dt_s)
