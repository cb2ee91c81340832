"""Find a free spot on a surface in front of the robot."""

import math
from collections.abc import Mapping
from typing import Any

import cv2
import numpy as np

from vla_deploy.skills.context import SkillContext
from vla_deploy.skills.errors import TryAgain
from vla_deploy.skills.frames import to_map

REACH_X_M = (0.38, 0.42, 0.46, 0.50)
REACH_Y_M = (0.0, 0.08, -0.08, 0.16, -0.16)
KEEP_APART_M = 0.14
EDGE_M = 0.06
SURFACE_HEIGHT_M = (0.25, 0.75)


def free_spot(context: SkillContext) -> tuple[float, float, float]:
    """Return a point of a seen surface, in the base frame, with room for the hand around it.

    Raises:
        TryAgain: no surface with a free spot is within reach.
    """
    for surface in context.link.surfaces:
        height_m = float(surface["height_m"])
        if not SURFACE_HEIGHT_M[0] <= height_m <= SURFACE_HEIGHT_M[1]:
            continue
        for x_m in REACH_X_M:
            for y_m in REACH_Y_M:
                if _fits(context, surface, x_m, y_m):
                    return x_m, y_m, height_m
    raise TryAgain("I see no free spot within reach to put it down")


def _fits(context: SkillContext, surface: Mapping[str, Any], x_m: float, y_m: float) -> bool:
    """Tell whether a spot lies well within the seen surface and away from what stands on it."""
    spot = to_map(context.link.pose, x_m, y_m)
    outline = np.array(surface["polygon_m"], dtype=np.float32)
    if cv2.pointPolygonTest(outline, spot, measureDist=True) < EDGE_M:
        return False
    return all(
        math.dist(spot, one["position_m"][:2]) > KEEP_APART_M for one in context.link.objects
    )
