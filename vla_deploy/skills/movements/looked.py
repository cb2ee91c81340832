"""Remember when each viewpoint's furniture was last looked at, from near enough to see it all."""

import math
from typing import Final

from drivers.clock import NS_PER_S
from vla_deploy.robots.floor_pose import Pose2D
from vla_deploy.skills.context import SkillContext, spoken
from vla_deploy.skills.movements.frames import to_base
from vla_deploy.skills.movements.whereabouts import room_at
from vla_deploy.world.surfaces import FURNITURE_AHEAD_M

FURNITURE_HEIGHT_M: Final = 0.5
SURELY_SEEN_M: Final = 1.5
"""Within it everything on furniture is recognised."""
VIEW_RAD: Final = 0.5
"""Half of what a camera sees across."""
LATELY_S: Final = 600.0
STEP_S: Final = 60.0


def furniture_of(viewpoint: Pose2D) -> tuple[float, float, float]:
    """Return the point of the map, on the furniture, that a viewpoint looks at."""
    return (*viewpoint.outward(FURNITURE_AHEAD_M, 0.0), FURNITURE_HEIGHT_M)


def viewpoint_names(context: SkillContext) -> dict[Pose2D, str]:
    """Return each viewpoint once, with the name of the furniture that it looks at."""
    names: dict[Pose2D, str] = {}
    places = context.robot.places.items()
    for name, place in sorted(places, key=lambda one: one[1].pose not in one[1].viewpoints):
        for number, viewpoint in enumerate(place.viewpoints, start=1):
            suffix = f" {number}" if len(place.viewpoints) > 1 else ""
            names.setdefault(viewpoint, f"{spoken(name)}{suffix}")
    return names


def note_looked(context: SkillContext) -> None:
    """Note the viewpoints whose furniture is before the camera now, near by and in this room."""
    pose, head, index = context.link.pose, context.robot.parts.head, context.robot.joint_index
    pan_rad = 0.0 if head is None else float(context.link.positions[index[head.pan]])
    here = room_at(context, pose.x_m, pose.y_m)
    for viewpoint in viewpoint_names(context):
        at = furniture_of(viewpoint)
        x_m, y_m, _ = to_base(pose, at)
        is_before = abs(math.remainder(math.atan2(y_m, x_m) - pan_rad, math.tau)) < VIEW_RAD
        if is_before and math.hypot(x_m, y_m) < SURELY_SEEN_M and room_at(context, *at[:2]) == here:
            context.looked[viewpoint] = context.link.clock.now_ns()


def staleness(context: SkillContext, viewpoint: Pose2D) -> int:
    """Return 0 for what was not looked at lately, and the more the less long ago it was."""
    looked_ns = context.looked.get(viewpoint)
    if looked_ns is None:
        return 0
    ago_s = (context.link.clock.now_ns() - looked_ns) / NS_PER_S
    return max(0, math.ceil((LATELY_S - ago_s) / STEP_S))
