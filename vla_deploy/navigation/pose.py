"""Place things on the floor: poses with x, y and yaw, and how they combine."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vla_deploy.navigation.follower import wrap_angle

Points = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Pose2D:
    """Place something on the floor."""

    x_m: float
    y_m: float
    yaw_rad: float

    def compose(self, other: "Pose2D") -> "Pose2D":
        """Return `other`, given in this pose's frame, in the frame that this pose is given in."""
        c, s = math.cos(self.yaw_rad), math.sin(self.yaw_rad)
        return Pose2D(
            self.x_m + c * other.x_m - s * other.y_m,
            self.y_m + s * other.x_m + c * other.y_m,
            wrap_angle(self.yaw_rad + other.yaw_rad),
        )

    def relative_to(self, frame: "Pose2D") -> "Pose2D":
        """Return this pose in the frame of another one."""
        c, s = math.cos(frame.yaw_rad), math.sin(frame.yaw_rad)
        dx, dy = self.x_m - frame.x_m, self.y_m - frame.y_m
        return Pose2D(c * dx + s * dy, c * dy - s * dx, wrap_angle(self.yaw_rad - frame.yaw_rad))

    def distance_m(self, other: "Pose2D") -> float:
        """Return how far another pose of the same frame is."""
        return math.hypot(self.x_m - other.x_m, self.y_m - other.y_m)

    def turn_rad(self, other: "Pose2D") -> float:
        """Return the angle between the two headings, without sign."""
        return abs(wrap_angle(self.yaw_rad - other.yaw_rad))

    def place(self, points: Points) -> Points:
        """Return (n, 2) points, given in this pose's frame, in the frame that it is given in."""
        c, s = math.cos(self.yaw_rad), math.sin(self.yaw_rad)
        placed: Points = points @ np.array([[c, s], [-s, c]]) + (self.x_m, self.y_m)
        return placed


ORIGIN = Pose2D(0.0, 0.0, 0.0)
