"""Tell on which side of the robot a hand is, and give points of the map in the base frame."""

from collections.abc import Sequence

from vla_deploy.robots.floor_pose import Pose2D
from vla_deploy.skills.context import SkillContext

ON_MIDDLE_M = 0.01


def side_of(context: SkillContext, hand: str) -> float:
    """Return 1 for a hand whose arm is left of, or on, the middle, and -1 for one to the right."""
    return 1.0 if context.arms[hand].shoulder_m[1] > -ON_MIDDLE_M else -1.0


def to_base(pose: Pose2D, point_m: Sequence[float]) -> tuple[float, float, float]:
    """Return a map-frame point (x, y, z) in the base frame of a robot at `pose`."""
    return *pose.local(point_m), float(point_m[2])
