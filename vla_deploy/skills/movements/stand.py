"""Choose where to stand so that the arms reach an object, straight ahead and with room around."""

import math
from collections.abc import Sequence

from vla_deploy.robots.floor_pose import Pose2D, wrap_angle
from vla_deploy.skills.context import SkillContext
from vla_deploy.skills.movements.frames import to_base
from vla_deploy.world.access import Stand, stands_around

# The object goes before one shoulder rather than between them.
SIDE_M = 0.12


def standing_poses(
    context: SkillContext, position_m: Sequence[float], anew: bool = False
) -> list[Pose2D]:
    """Return free poses facing an object, the one quickest to reach first.

    The present pose alone, where it will do, unless they are wanted `anew`; none anew of a robot
    that does not drive.
    """
    pose, reach = context.link.pose, context.robot.reach
    if not anew and reach.has(to_base(pose, position_m)):
        return [pose]
    candidates = []
    for stand in stands_around(position_m, context.planner.is_free, reach):
        goal = _facing(context, stand)
        further_m = stand.reach_m - reach.distances_m[0]
        candidates.append((effort(pose, goal) + 2.0 * further_m, stand, goal))
    return [goal for _, _, goal in sorted(candidates, key=lambda one: (one[0], one[1].step))][:6]


def _facing(context: SkillContext, stand: Stand) -> Pose2D:
    """Turn a stand so that the object comes before the shoulder of the hand that takes it."""
    side_rad = math.asin(min(1.0, _side_m(context) / stand.reach_m))
    return Pose2D(x_m=stand.x_m, y_m=stand.y_m, yaw_rad=wrap_angle(stand.bearing_rad - side_rad))


def _side_m(context: SkillContext) -> float:
    """Return how far left (positive) of the centre line the object should end up."""
    held = [name for name, what in context.hands.items() if what is not None]
    return -SIDE_M if held == ["right"] else SIDE_M


def effort(pose: Pose2D, goal: Pose2D) -> float:
    """Return an estimate of the way in metres; a radian of turning counts as a third of a metre."""
    heading = math.atan2(goal.y_m - pose.y_m, goal.x_m - pose.x_m)
    turning = abs(wrap_angle(heading - pose.yaw_rad)) + abs(wrap_angle(goal.yaw_rad - heading))
    return pose.distance_m(goal) + turning / 3.0
