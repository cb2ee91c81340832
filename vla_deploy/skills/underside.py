"""Draw arms out from under furniture before they rise: without power they may have sunk there."""

import cv2
import numpy as np
from numpy.typing import NDArray

from vla_deploy.robots.description import FloorPose
from vla_deploy.skills.context import Skill, SkillContext
from vla_deploy.skills.drive import straight
from vla_deploy.skills.errors import NotPossible
from vla_deploy.skills.frames import on_floor, to_map

# Around a joint's middle: half an arm's width, and what a seen surface may lack at its edge.
BESIDE_M = 0.07
# A table's top and half an arm: a hand beside a thing that lies on a table is under nothing.
BELOW_M = 0.03
STEP_BACK_M = 0.05
FARTHEST_BACK_M = 0.6
# While arms are out, and may hang beside a table's leg.
BACK_OFF_M_S = 0.1


def leave_underside(context: SkillContext) -> Skill:
    """Drive back until no part of an arm is under a surface that is seen, if one is.

    Raises:
        NotPossible: no way straight back frees it, or the map shows no room for it.
        TryAgain: something stands behind the robot.
    """
    distance_m = way_back_m(context)
    if distance_m > 0.0:
        yield from straight(context, -distance_m, BACK_OFF_M_S)


def way_back_m(context: SkillContext) -> float:
    """Return how far back the base has to go for its arms to be free, 0 where they are.

    Raises:
        NotPossible: nothing within `FARTHEST_BACK_M` frees them.
    """
    steps = round(FARTHEST_BACK_M / STEP_BACK_M)
    for back_m in (STEP_BACK_M * step for step in range(steps + 1)):
        x_m, y_m = to_map(context.link.pose, -back_m, 0.0)
        there = FloorPose(x_m=x_m, y_m=y_m, yaw_rad=context.link.pose.yaw_rad)
        hands = [name for name in context.arms if _is_under(context, name, there)]
        if not hands:
            return back_m
    raise NotPossible(
        f"the {hands[0]} arm is under a table, and driving {FARTHEST_BACK_M} m back would not free"
        " it; draw it out by hand"
    )


def _is_under(context: SkillContext, hand: str, pose: FloorPose) -> bool:
    """Tell whether a part of an arm would be below a seen surface, were the base at a pose."""
    points_m = context.arms[hand].points(context.link.positions)
    places_m = on_floor(pose, points_m[:, :2])
    return any(
        _reaches_into(np.array(surface["polygon_m"], dtype=np.float32), low_m)
        for surface in context.link.surfaces
        if len(low_m := places_m[points_m[:, 2] < float(surface["height_m"]) - BELOW_M])
    )


def _reaches_into(outline: NDArray[np.float32], places_m: NDArray[np.float64]) -> bool:
    return any(
        cv2.pointPolygonTest(outline, (float(x_m), float(y_m)), measureDist=True) > -BESIDE_M
        for x_m, y_m in places_m
    )
