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
_UNBOUNDED: Final = 1e12

Floats = NDArray[np.float64]


class TrajectoryProfile:
    """Hold the trajectory of each servo in pulses and pulses per second."""

    def __init__(self, columns: TableColumns) -> None:
        count = len(columns.goal_position)
        self._columns = columns
        self.position = np.zeros(count)
        self.velocity = np.zeros(count)
        self._speed = np.full(count, _UNBOUNDED)
        self._acceleration = np.full(count, _UNBOUNDED)
        self.active = False

    def reload(self) -> None:
        """Take over profile registers that the host or the firmware changed."""
        columns = self._columns
        by_speed = (columns.drive_mode & TIME_BASED) == 0
        units = np.minimum(columns.profile_velocity, columns.velocity_limit)
        speed = np.where(units > 0, units * PULSES_S_PER_UNIT, _UNBOUNDED)
        stepped = (columns.profile_acceleration == 0) | (units == 0)
        ramp = columns.profile_acceleration * PULSES_S2_PER_UNIT
        acceleration = np.where(stepped, _UNBOUNDED, ramp)
        self._speed = np.where(by_speed, speed, self._speed)
        self._acceleration = np.where(by_speed, acceleration, self._acceleration)
        self.active = bool((self._speed < _UNBOUNDED).any())

    def on_goal(self, row: int) -> None:
        """Turn a time-based profile into speeds for the distance that a new goal asks for."""
        columns = self._columns
        if not columns.drive_mode[row] & TIME_BASED:
            return
        span_s = float(columns.profile_velocity[row]) / 1e3
        ramp_s = min(float(columns.profile_acceleration[row]) / 1e3, span_s / 2)
        distance = abs(float(columns.goal_position[row]) - float(self.position[row]))
        speed = distance / (span_s - ramp_s) if span_s > 0 else _UNBOUNDED
        self._speed[row] = max(speed, 1.0)
        self._acceleration[row] = max(speed, 1.0) / ramp_s if ramp_s > 0 else _UNBOUNDED
        self.active = bool((self._speed < _UNBOUNDED).any())

    def restart(self, rows: NDArray[np.bool_] | int, position: Floats | float) -> None:
        """Begin anew at rest at `position`."""
        self.position[rows] = position
        self.velocity[rows] = 0.0

    def advance(self, dt_s: float) -> None:
        """Move every setpoint on by one step."""
        if not self.active:
            self.position[:] = self._columns.goal_position
            return
        distance = self._columns.goal_position - self.position
        braking = np.sqrt(2.0 * self._acceleration * np.abs(distance))
        wanted = np.copysign(np.minimum(self._speed, braking), distance)
        change = self._acceleration * dt_s
        velocity = np.clip(wanted, self.velocity - change, self.velocity + change)
        step = velocity * dt_s
        arrives = (np.abs(distance) <= np.abs(step)) & (distance * velocity >= 0.0)
        self.velocity = np.where(arrives, 0.0, velocity)
        self.position = np.where(arrives, self._columns.goal_position, self.position + step)
