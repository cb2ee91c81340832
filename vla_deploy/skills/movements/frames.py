"""Convert between the map frame and the base frame on the floor."""

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from vla_deploy.robots.description import FloorPose


def side_of(hand: str) -> float:
    """Return 1 for the left hand and -1 for the right: y grows to the left."""
    return 1.0 if hand == "left" else -1.0


def to_base(pose: FloorPose, point_m: Sequence[float]) -> tuple[float, float, float]:
    """Return a map-frame point (x, y, z) in the base frame of a robot at `pose`."""
    dx, dy = point_m[0] - pose.x_m, point_m[1] - pose.y_m
    cosine, sine = math.cos(pose.yaw_rad), math.sin(pose.yaw_rad)
    return cosine * dx + sine * dy, cosine * dy - sine * dx, float(point_m[2])


def to_map(pose: FloorPose, x_m: float, y_m: float) -> tuple[float, float]:
    """Return a base-frame point of the floor in the map frame."""
    cosine, sine = math.cos(pose.yaw_rad), math.sin(pose.yaw_rad)
    return pose.x_m + cosine * x_m - sine * y_m, pose.y_m + sine * x_m + cosine * y_m


def on_floor(pose: FloorPose, points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return (n, 2) base-frame points of the floor in the map frame."""
    cosine, sine = math.cos(pose.yaw_rad), math.sin(pose.yaw_rad)
    turn = np.array([[cosine, sine], [-sine, cosine]])
    moved: NDArray[np.float64] = points @ turn + np.array((pose.x_m, pose.y_m))
    return moved
