"""Find free spots on the surfaces in front of the robot."""

from collections.abc import Mapping
from typing import Any

import cv2
import numpy as np

from vla_deploy.skills.context import SkillContext
from vla_deploy.skills.frames import to_map
from vla_deploy.world.document import read_thing
from vla_deploy.world.footprint import depth_inside_m

REACH_X_M = (0.38, 0.42, 0.46, 0.50)
# On the hand's own side first.
REACH_Y_M = (0.12, 0.04, 0.20, -0.04, -0.12)
# From a thing's outline to the middle of what is put down: half of that, and an opening finger.
APART_M = 0.10
EDGE_M = 0.06
SURFACE_HEIGHT_M = (0.25, 0.75)


def free_spots(context: SkillContext, hand: str) -> list[tuple[float, float, float]]:
    """Return points of seen surfaces, in the base frame, with room for a hand; the best first."""
    side = 1.0 if hand == "left" else -1.0
    return [
        (x_m, side * y_m, height_m)
        for surface in context.link.surfaces
        if SURFACE_HEIGHT_M[0] <= (height_m := float(surface["height_m"])) <= SURFACE_HEIGHT_M[1]
        for x_m in REACH_X_M
        for y_m in REACH_Y_M
        if _fits(context, surface, x_m, side * y_m)
    ]


def _fits(context: SkillContext, surface: Mapping[str, Any], x_m: float, y_m: float) -> bool:
    """Tell whether a spot lies well within the seen surface and away from what stands on it."""
    spot = to_map(context.link.pose, x_m, y_m)
    outline = np.array(surface["polygon_m"], dtype=np.float32)
    if cv2.pointPolygonTest(outline, spot, measureDist=True) < EDGE_M:
        return False
    things = map(read_thing, context.link.objects)
    return all(depth_inside_m(spot, one) < -APART_M for one in things if not one.held_by)
