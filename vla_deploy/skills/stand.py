"""Choose where to stand so that the arms reach an object, straight ahead and with room around."""

import math
from collections.abc import Sequence

from vla_deploy.navigation.follower import wrap_angle
from vla_deploy.robots.description import FloorPose
from vla_deploy.skills.context import SkillContext
from vla_deploy.skills.frames import to_base

# Distance from the base's centre to the object: best first, all within the arms' reach.
REACH_M = (0.42, 0.46, 0.50, 0.54)
DIRECTIONS = 36
# The object goes before one shoulder rather than between them.
SIDE_M = 0.12


def standing_poses(
    context: SkillContext, position_m: Sequence[float], anew: bool = False
) -> list[FloorPose]:
    """Return free poses facing an object, the one quickest to reach first.

    The present pose alone, where it will do, unless they are wanted `anew`.
    """
    pose = context.link.pose
    here = to_base(pose, position_m)
    if (
        not anew
        and math.hypot(here[0], here[1]) <= REACH_M[-1]
        and abs(here[1]) <= 0.2
        and here[0] > 0.3
    ):
        return [pose]
    candidates = []
    for step in range(DIRECTIONS):
        bearing_rad = 2 * math.pi * step / DIRECTIONS
        found = _nearest_free(context, position_m, bearing_rad)
        if found is not None:
            reach_m, goal = found
            candidates.append((_effort(pose, goal) + 2.0 * (reach_m - REACH_M[0]), step, goal))
    return [goal for _, _, goal in sorted(candidates, key=lambda one: one[:2])][:6]


def _nearest_free(
    context: SkillContext, position_m: Sequence[float], bearing_rad: float
) -> tuple[float, FloorPose] | None:
    for reach_m in REACH_M:
        x_m = position_m[0] - reach_m * math.cos(bearing_rad)
        y_m = position_m[1] - reach_m * math.sin(bearing_rad)
        if context.planner.is_free(x_m, y_m):
            side_rad = math.asin(min(1.0, _side_m(context) / reach_m))
            yaw_rad = wrap_angle(bearing_rad - side_rad)
            return reach_m, FloorPose(x_m=x_m, y_m=y_m, yaw_rad=yaw_rad)
    return None


def _side_m(context: SkillContext) -> float:
    """Return how far left (positive) of the centre line the object should end up."""
    held = [name for name, what in context.hands.items() if what is not None]
    return -SIDE_M if held == ["right"] else SIDE_M


def _effort(pose: FloorPose, goal: FloorPose) -> float:
    """Estimate the way in metres; a radian of turning counts as a third of a metre."""
    distance_m = math.hypot(goal.x_m - pose.x_m, goal.y_m - pose.y_m)
    heading = math.atan2(goal.y_m - pose.y_m, goal.x_m - pose.x_m)
    turning = abs(wrap_angle(heading - pose.yaw_rad)) + abs(wrap_angle(goal.yaw_rad - heading))
    return distance_m + turning / 3.0
