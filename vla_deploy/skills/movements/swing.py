"""Choose how high a hand swings to a place, so that it knocks nothing over on the way."""

import math

from vla_deploy.skills.context import SkillContext
from vla_deploy.skills.movements.frames import to_base

AROUND_M = 0.4
# Nearer than this it is the thing itself that is reached for.
SAME_M = 0.06
# What is no further in front of hands that are out is in a hand, not on furniture.
OUT_MARGIN_M = 0.03
MARGIN_M = 0.03
# Most of what is not recognised is a part of larger furniture, out of the way.
UNKNOWN = "object"


def heights_above(
    context: SkillContext, point_m: tuple[float, float, float], below_m: float, least_m: float
) -> list[float]:
    """Return heights above a grip point to swing in at, the safest first.

    The first lets what reaches `below_m` under the grip pass above all known things around; the
    last is `least_m`, for where the arm cannot be so high.
    """
    tops = []
    for one in context.link.objects:
        x_m, y_m, z_m = to_base(context.link.pose, one["position_m"])
        gap_m = math.hypot(x_m - point_m[0], y_m - point_m[1])
        stands = one["class"] != UNKNOWN and x_m > context.robot.reach.out_m + OUT_MARGIN_M
        if stands and SAME_M < gap_m < AROUND_M:
            tops.append(z_m + float(one["size_m"][2]) / 2)
    wanted_m = max(tops, default=0.0) + MARGIN_M + below_m - point_m[2]
    return [least_m] if wanted_m <= least_m else [wanted_m, least_m]
