"""Place things on the floor: poses with x, y and yaw, and how they combine."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

Points = NDArray[np.float64]


def wrap_angle(angle_rad: float) -> float:
    """Return the same angle within (-pi, pi]."""
    return math.pi - (math.pi - angle_rad) % (2 * math.pi)


@dataclass(frozen=True, slots=True)
class Pose2D:
    """Place something on the floor, such as the robot's base in the map frame."""

    x_m: float
    y_m: float
    yaw_rad: float

    @classmethod
    def of(cls, data: np.void) -> Self:
        """Return the pose in the fields of a topic."""
        return cls(*(float(data[name]) for name in ("x_m", "y_m", "yaw_rad")))

    def compose(self, other: "Pose2D") -> "Pose2D":
        """Return `other`, given in this pose's frame, in the frame that this pose is given in."""
        x_m, y_m = self.outward(other.x_m, other.y_m)
        return Pose2D(x_m, y_m, wrap_angle(self.yaw_rad + other.yaw_rad))

    def relative_to(self, frame: "Pose2D") -> "Pose2D":
        """Return this pose in the frame of another one."""
        x_m, y_m = frame.local((self.x_m, self.y_m))
        return Pose2D(x_m, y_m, wrap_angle(self.yaw_rad - frame.yaw_rad))

    def outward(self, x_m: float, y_m: float) -> tuple[float, float]:
        """Return a point of this pose's frame in the frame that this pose is given in."""
        c, s = math.cos(self.yaw_rad), math.sin(self.yaw_rad)
        return self.x_m + c * x_m - s * y_m, self.y_m + s * x_m + c * y_m

    def local(self, point_m: Sequence[float]) -> tuple[float, float]:
        """Return x and y, in this pose's frame, of a point in the frame that it is given in."""
        c, s = math.cos(self.yaw_rad), math.sin(self.yaw_rad)
        dx, dy = point_m[0] - self.x_m, point_m[1] - self.y_m
        return c * dx + s * dy, c * dy - s * dx

    def place(self, points: Points) -> Points:
        """Return (n, 2) points, given in this pose's frame, in the frame that it is given in."""
        c, s = math.cos(self.yaw_rad), math.sin(self.yaw_rad)
        placed: Points = points @ np.array([[c, s], [-s, c]]) + (self.x_m, self.y_m)
        return placed

    def distance_m(self, other: "Pose2D") -> float:
        """Return how far another pose of the same frame is."""
        return math.hypot(self.x_m - other.x_m, self.y_m - other.y_m)

    def turn_rad(self, other: "Pose2D") -> float:
        """Return the angle between the two headings, without sign."""
        return abs(wrap_angle(self.yaw_rad - other.yaw_rad))


ORIGIN = Pose2D(0.0, 0.0, 0.0)
