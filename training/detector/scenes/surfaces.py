"""Describe where things can stand."""

import math
from dataclasses import dataclass

from training.detector.scenes.parts import Random, between


@dataclass(frozen=True, slots=True, kw_only=True)
class SceneSurface:
    """Hold a level rectangle: centre, turn, half sizes and height, all in the world's frame."""

    x_m: float
    y_m: float
    yaw_rad: float
    half_x_m: float
    half_y_m: float
    height_m: float

    def point(self, random: Random, margin_m: float) -> tuple[float, float]:
        """Return a point at least the margin from the edge, or the middle of what is narrower."""
        a, b = (max(0.0, half - margin_m) for half in (self.half_x_m, self.half_y_m))
        u, v = between(random, -a, a), between(random, -b, b)
        c, s = math.cos(self.yaw_rad), math.sin(self.yaw_rad)
        return self.x_m + c * u - s * v, self.y_m + s * u + c * v

    def covers(self, x_m: float, y_m: float, margin_m: float) -> bool:
        """Return whether the point lies on the rectangle or within the margin around it."""
        c, s = math.cos(self.yaw_rad), math.sin(self.yaw_rad)
        dx, dy = x_m - self.x_m, y_m - self.y_m
        u, v = c * dx + s * dy, -s * dx + c * dy
        return abs(u) < self.half_x_m + margin_m and abs(v) < self.half_y_m + margin_m


@dataclass(frozen=True, slots=True, kw_only=True)
class CameraViewpoint:
    """Hold where the robot stands and the point at which its head looks."""

    x_m: float
    y_m: float
    yaw_rad: float
    target: tuple[float, float, float]

    def ahead(self, forward_m: float, left_m: float) -> tuple[float, float]:
        """Return the world's coordinates of a point in the robot's frame."""
        c, s = math.cos(self.yaw_rad), math.sin(self.yaw_rad)
        return self.x_m + c * forward_m - s * left_m, self.y_m + s * forward_m + c * left_m
