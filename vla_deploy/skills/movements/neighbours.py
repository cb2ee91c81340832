"""Tell how near the open hand comes to what stands beside the thing that it goes down to take."""

import math
from collections.abc import Mapping
from typing import Any

from vla_deploy.manipulation.grasps import TIP_BEYOND_GRIP_M, Grasp
from vla_deploy.skills.context import SkillContext
from vla_deploy.skills.movements.frames import to_base
from vla_deploy.skills.movements.swing import UNKNOWN

# Fingers and palm stand on a line across the hand: so much beyond the opening, and to its sides.
FINGER_M = 0.01
HALF_HAND_M = 0.02
MARGIN_M = 0.01


def crowding_m(context: SkillContext, grasp: Grasp, taken: Mapping[str, Any]) -> float:
    """Return how deep the hand gets into the room of the nearest neighbour, 0 where it is free.

    Things count as upright cylinders, if they reach up to the finger tips.
    """
    return max((_depth_m(context, grasp, one) for one in _others(context, taken)), default=0.0)


def _others(context: SkillContext, taken: Mapping[str, Any]) -> list[Mapping[str, Any]]:
    """Return what stands around: not the thing itself, nor what it lies in or on."""
    own = (taken.get("id"), (taken.get("rests") or {}).get("of"))
    return [
        one for one in context.link.objects if one["class"] != UNKNOWN and one.get("id") not in own
    ]


def _depth_m(context: SkillContext, grasp: Grasp, one: Mapping[str, Any]) -> float:
    x_m, y_m, z_m = to_base(context.link.pose, one["position_m"])
    length_m, width_m, height_m = (float(side) for side in one["size_m"])
    if z_m + height_m / 2 < grasp.point_m[2] - TIP_BEYOND_GRIP_M:
        return 0.0
    dx_m, dy_m = x_m - grasp.point_m[0], y_m - grasp.point_m[1]
    sine, cosine = math.sin(grasp.yaw_rad), math.cos(grasp.yaw_rad)
    ahead_m, across_m = cosine * dx_m + sine * dy_m, sine * dx_m - cosine * dy_m
    beyond_m = max(abs(across_m) - grasp.opening_m / 2 - FINGER_M, 0.0)
    needed_m = max(length_m, width_m) / 2 + HALF_HAND_M + MARGIN_M
    return max(needed_m - math.hypot(ahead_m, beyond_m), 0.0)
