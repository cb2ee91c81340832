"""Judge how near the open hand comes to what stands beside the thing that it goes to take."""

import math
from collections.abc import Mapping
from typing import Any

from vla_deploy.manipulation.grasps import TIP_BEYOND_GRIP_M, Grasp, GraspKind
from vla_deploy.skills.context import SkillContext
from vla_deploy.skills.movements.frames import to_base
from vla_deploy.skills.movements.swing import SAME_M, UNKNOWN

# Fingers and palm stand on a line across the hand: so much beyond the opening, and to its sides.
FINGER_M = 0.01
HALF_HAND_M = 0.02
MARGIN_M = 0.01
# What is not recognised and no larger is no furniture: it may stand where a hand comes in.
SMALL_M = 0.2
# From the side wrist and hand follow the fingers in: so long from the grip, so thick up and down.
HAND_LENGTH_M = 0.2
HALF_THICK_M = 0.03


def crowding_m(context: SkillContext, grasp: Grasp, taken: Mapping[str, Any]) -> float:
    """Return how deep the hand gets into the room of the nearest neighbour, 0 where it is free.

    Things count as upright cylinders, if they reach up to the finger tips; from the side, if they
    stand beside the way on which the hand comes in.
    """
    is_side = grasp.kind is GraspKind.SIDE
    depth_m = _depth_on_way_m if is_side else _depth_m
    others = [
        one
        for one in _others(context, taken)
        if one["class"] != UNKNOWN or (is_side and _is_small_neighbour(context, grasp, one))
    ]
    return max((depth_m(context, grasp, one) for one in others), default=0.0)


def _others(context: SkillContext, taken: Mapping[str, Any]) -> list[Mapping[str, Any]]:
    """Return what is around: not the thing itself, nor what it lies in or on."""
    own = (taken.get("id"), (taken.get("rests") or {}).get("of"))
    return [one for one in context.link.objects if one.get("id") not in own]


def _is_small_neighbour(context: SkillContext, grasp: Grasp, one: Mapping[str, Any]) -> bool:
    """Return whether what is not recognised is no furniture, nor a part of the thing itself."""
    x_m, y_m, _ = to_base(context.link.pose, one["position_m"])
    away_m = math.hypot(x_m - grasp.point_m[0], y_m - grasp.point_m[1])
    return away_m > SAME_M and max(float(side) for side in one["size_m"][:2]) < SMALL_M


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


def _depth_on_way_m(context: SkillContext, grasp: Grasp, one: Mapping[str, Any]) -> float:
    """Return how deep a hand that comes in from the side gets into the room of a thing."""
    x_m, y_m, z_m = to_base(context.link.pose, one["position_m"])
    length_m, width_m, height_m = (float(side) for side in one["size_m"])
    lowest_m = grasp.point_m[2] - HALF_THICK_M
    level, rise = abs(math.sin(grasp.tilt_rad)), math.cos(grasp.tilt_rad)
    behind_m = level * (HAND_LENGTH_M + grasp.way_in_m)
    highest_m = grasp.point_m[2] + HALF_THICK_M + rise * (HAND_LENGTH_M + grasp.way_in_m)
    above_m = z_m + height_m / 2 - lowest_m
    if above_m < 0.0 or z_m - height_m / 2 > highest_m:
        return 0.0
    if rise * behind_m > level * above_m:
        behind_m = level * above_m / rise  # farther back an inclined hand is above the thing
    heading_rad = grasp.yaw_rad + (math.pi if grasp.tilt_rad < 0.0 else 0.0)
    dx_m, dy_m = x_m - grasp.point_m[0], y_m - grasp.point_m[1]
    sine, cosine = math.sin(heading_rad), math.cos(heading_rad)
    ahead_m, across_m = cosine * dx_m + sine * dy_m, sine * dx_m - cosine * dy_m
    beyond_m = ahead_m - min(max(ahead_m, -behind_m), TIP_BEYOND_GRIP_M)
    needed_m = max(length_m, width_m) / 2 + grasp.opening_m / 2 + FINGER_M + MARGIN_M
    return max(needed_m - math.hypot(beyond_m, across_m), 0.0)
