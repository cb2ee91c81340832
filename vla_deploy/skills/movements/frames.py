"""Name the sides of the hands, and give points of the map in the base frame."""

from collections.abc import Sequence

from vla_deploy.robots.floor_pose import Pose2D


def side_of(hand: str) -> float:
    """Return 1 for the left hand and -1 for the right: y grows to the left."""
    return 1.0 if hand == "left" else -1.0


def to_base(pose: Pose2D, point_m: Sequence[float]) -> tuple[float, float, float]:
    """Return a map-frame point (x, y, z) in the base frame of a robot at `pose`."""
    return *pose.local(point_m), float(point_m[2])
