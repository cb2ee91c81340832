"""Add up what the wheels have turned to the base's pose."""

import math

from vla_deploy.control.output.base_kinematics import BaseKinematics


class Odometry:
    """Integrate wheel angles exactly: between two readings the base drives an arc."""

    def __init__(self, geometry: BaseKinematics) -> None:
        self.x_m = 0.0
        self.y_m = 0.0
        self.yaw_rad = 0.0
        self._geometry = geometry
        self._last: tuple[float, ...] | None = None

    def update(self, *wheels_rad: float) -> None:
        """Take the wheels' angles; the first reading only sets where they are."""
        last, self._last = self._last, wheels_rad
        if last is None:
            return
        turned = (now - before for now, before in zip(wheels_rad, last, strict=True))
        ahead_m, turn, left_m = self._geometry.base_velocity(*turned)
        half = 0.5 * turn
        chord = 1.0 if abs(half) < 1e-9 else math.sin(half) / half
        c, s = math.cos(self.yaw_rad + half), math.sin(self.yaw_rad + half)
        self.x_m += chord * (ahead_m * c - left_m * s)
        self.y_m += chord * (ahead_m * s + left_m * c)
        self.yaw_rad = math.remainder(self.yaw_rad + turn, math.tau)

    def forget_wheels(self) -> None:
        """Keep the pose but take the next reading as a new start, after drives were away."""
        self._last = None
