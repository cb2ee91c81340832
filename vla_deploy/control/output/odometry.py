"""Turn wheel angles into the base's pose and base velocities into wheel speeds."""

import math
from dataclasses import dataclass


@dataclass(frozen=True, slots=True, kw_only=True)
class DifferentialDrive:
    """Carry a differential drive's wheel radius and the distance between its wheels."""

    wheel_radius_m: float
    track_m: float

    def wheel_speeds(self, v_m_s: float, w_rad_s: float) -> tuple[float, float]:
        """Return left and right wheel speed in rad/s for a base velocity."""
        turn = 0.5 * self.track_m * w_rad_s
        return (v_m_s - turn) / self.wheel_radius_m, (v_m_s + turn) / self.wheel_radius_m

    def base_velocity(self, left_rad_s: float, right_rad_s: float) -> tuple[float, float]:
        """Return forward and turning velocity for the wheels' speeds."""
        left, right = left_rad_s * self.wheel_radius_m, right_rad_s * self.wheel_radius_m
        return 0.5 * (left + right), (right - left) / self.track_m


class Odometry:
    """Integrate wheel angles exactly: between two readings the base drives an arc."""

    def __init__(self, geometry: DifferentialDrive) -> None:
        self.x_m = 0.0
        self.y_m = 0.0
        self.yaw_rad = 0.0
        self._geometry = geometry
        self._last: tuple[float, float] | None = None

    def update(self, left_rad: float, right_rad: float) -> None:
        """Take the wheels' angles; the first reading only sets where they are."""
        last, self._last = self._last, (left_rad, right_rad)
        if last is None:
            return
        length, turn = self._geometry.base_velocity(left_rad - last[0], right_rad - last[1])
        half = 0.5 * turn
        chord = length if abs(half) < 1e-9 else length * math.sin(half) / half
        self.x_m += chord * math.cos(self.yaw_rad + half)
        self.y_m += chord * math.sin(self.yaw_rad + half)
        self.yaw_rad = math.remainder(self.yaw_rad + turn, math.tau)

    def forget_wheels(self) -> None:
        """Keep the pose but take the next reading as a new start, after drives were away."""
        self._last = None
