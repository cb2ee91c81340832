"""Draw arms out from under furniture before they rise: without power they may have sunk there."""

from collections.abc import Iterator

import cv2
import numpy as np
from numpy.typing import NDArray

from drivers.clock import NS_PER_S
from vla_deploy.skills.context import Skill, SkillContext
from vla_deploy.skills.errors import NotPossible
from vla_deploy.skills.movements.drive import straight
from vla_deploy.skills.movements.motion import wait_until

Floats = NDArray[np.float64]

# Around a joint's middle: half an arm's width, and what a seen surface may lack at its edge.
BESIDE_M = 0.07
# A table's top and half an arm: a hand beside a thing that lies on a table is under nothing.
BELOW_M = 0.03
STEP_BACK_M = 0.05
FARTHEST_BACK_M = 0.6
# While arms are out, and may hang beside a table's leg.
BACK_OFF_M_S = 0.1
# A robot that has just started sees no furniture before it knows where it is.
SEEN_WITHIN_S, LOOK_PATIENCE_S = 2.0, 5.0


def leave_underside(context: SkillContext) -> Skill:
    """Drive back until no part of an arm is under a surface that is seen, if one is.

    Raises:
        NotPossible: no way straight back frees it, or the map shows no room for it.
        TryAgain: something stands behind the robot.
    """
    yield from wait_until(context, lambda: _has_looked(context), LOOK_PATIENCE_S)
    distance_m = way_back_m(context)
    if distance_m > 0.0:
        yield from straight(context, -distance_m, BACK_OFF_M_S)


def way_back_m(context: SkillContext) -> float:
    """Return how far back the base has to go for its arms to be free, 0 where they are.

    It is 0, too, for a robot without a base, which never gets under furniture by itself.

    Raises:
        NotPossible: nothing within `FARTHEST_BACK_M` frees them.
    """
    if context.robot.parts.base is None:
        return 0.0
    pose, parts = context.link.pose, list(_low_parts(context))
    hands: list[str] = []
    for step in range(round(FARTHEST_BACK_M / STEP_BACK_M) + 1):
        back_m = STEP_BACK_M * step
        hands = [
            hand
            for hand, outline, low_m in parts
            if _reaches_into(outline, pose.place(low_m - (back_m, 0.0)))
        ]
        if not hands:
            return back_m
    raise NotPossible(
        f"the {hands[0]} arm is under a table, and driving {FARTHEST_BACK_M} m back would not free"
        " it; draw it out by hand"
    )


def _has_looked(context: SkillContext) -> bool:
    age_ns = context.link.clock.now_ns() - context.link.scene_stamp_ns
    return age_ns <= SEEN_WITHIN_S * NS_PER_S


def _low_parts(context: SkillContext) -> Iterator[tuple[str, NDArray[np.float32], Floats]]:
    """Yield what of each hand's arm is lower than each seen surface, (n, 2) in the base frame."""
    for hand, arm in context.arms.items():
        points_m = arm.points(context.link.positions)
        for surface in context.link.surfaces:
            low = points_m[:, 2] < float(surface["height_m"]) - BELOW_M
            yield hand, np.array(surface["polygon_m"], dtype=np.float32), points_m[low, :2]


def _reaches_into(outline: NDArray[np.float32], places_m: Floats) -> bool:
    return any(
        cv2.pointPolygonTest(outline, (float(x_m), float(y_m)), measureDist=True) > -BESIDE_M
        for x_m, y_m in places_m
    )
