"""Choose how to grasp: where the fingers go, how wide they open, how hard they press."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from vla_deploy.manipulation.errors import TooWide


@dataclass(frozen=True, slots=True, kw_only=True)
class GraspRule:
    """Say how one kind of object is grasped from above.

    `depth_ratio` is how far down the object, from its top, the grip point goes; `depth_max_m` and
    the fingers' reach bound it. `round` objects may be grasped at any yaw. `effort_ratio` is the
    share of the gripper servo's stall torque.
    """

    depth_ratio: float
    depth_max_m: float
    effort_ratio: float
    round: bool


GRASP_RULES: Mapping[str, GraspRule] = MappingProxyType(
    {
        "cup": GraspRule(depth_ratio=0.45, depth_max_m=0.045, effort_ratio=0.25, round=True),
        "ball": GraspRule(depth_ratio=0.5, depth_max_m=0.04, effort_ratio=0.25, round=True),
        "bottle": GraspRule(depth_ratio=0.3, depth_max_m=0.05, effort_ratio=0.3, round=True),
        "book": GraspRule(depth_ratio=0.6, depth_max_m=0.03, effort_ratio=0.35, round=False),
        "phone": GraspRule(depth_ratio=0.7, depth_max_m=0.03, effort_ratio=0.3, round=False),
        "keys": GraspRule(depth_ratio=0.7, depth_max_m=0.03, effort_ratio=0.3, round=False),
        "can": GraspRule(depth_ratio=0.4, depth_max_m=0.045, effort_ratio=0.3, round=True),
        "bowl": GraspRule(depth_ratio=0.45, depth_max_m=0.04, effort_ratio=0.25, round=True),
        "remote": GraspRule(depth_ratio=0.7, depth_max_m=0.03, effort_ratio=0.3, round=False),
        "block": GraspRule(depth_ratio=0.5, depth_max_m=0.03, effort_ratio=0.25, round=False),
        "object": GraspRule(depth_ratio=0.5, depth_max_m=0.04, effort_ratio=0.25, round=False),
    }
)
# The finger tips reach this far beyond the grip point and must stay above the support.
TIP_BEYOND_GRIP_M = 0.012
SUPPORT_CLEARANCE_M = 0.006
OPENING_MARGIN_M = 0.02
SIZE_DOUBT_M = 0.02
"""A thing is seen that much too wide at times (a book of 65 mm as 86): from close by it is judged
anew, and until then only what is wider is refused."""
ROUND_YAWS = 16


@dataclass(frozen=True, slots=True, kw_only=True)
class Grasp:
    """Give one top-down grasp: the grip pose's point and yaw, and the fingers' openings."""

    point_m: tuple[float, float, float]
    yaw_rad: float
    width_m: float
    opening_m: float
    effort_ratio: float
    below_grip_m: float


def require_fit(
    kind: str, size_m: tuple[float, float, float], opening_max_m: float, doubt_m: float = 0.0
) -> float:
    """Return how wide an object is between the fingers.

    Raises:
        TooWide: it is wider than they open, by more than `doubt_m`.
    """
    rule = GRASP_RULES.get(kind, GRASP_RULES["object"])
    width_m = max(size_m[:2]) if rule.round else min(size_m[:2])
    if width_m + 0.5 * OPENING_MARGIN_M > opening_max_m + doubt_m:
        raise TooWide(
            f"the {kind} is {width_m * 1000:.0f} mm wide where the fingers would take it; "
            f"they open {opening_max_m * 1000:.0f} mm"
        )
    return width_m


def grasps_from_above(
    kind: str,
    centre_m: tuple[float, float, float],
    size_m: tuple[float, float, float],
    yaw_rad: float,
    opening_max_m: float,
    doubt_m: float = 0.0,
) -> list[Grasp]:
    """Return the grasps of an object in the frame of `centre_m`, the plainest first.

    `size_m` is length along `yaw_rad`, width across it, height.

    Raises:
        TooWide: its narrow side is wider than the fingers open, by more than `doubt_m`.
    """
    rule = GRASP_RULES.get(kind, GRASP_RULES["object"])
    length_m, across_m, height_m = size_m
    width_m = require_fit(kind, size_m, opening_max_m, doubt_m)
    depth_m = min(rule.depth_ratio * height_m, rule.depth_max_m)
    lowest_m = TIP_BEYOND_GRIP_M + SUPPORT_CLEARANCE_M
    above_bottom_m = max(height_m - depth_m, lowest_m)
    # The hand's y axis closes: across the object when its length lies along yaw.
    closing_rad = yaw_rad if length_m >= across_m else yaw_rad + math.pi / 2
    yaws = (
        [2 * math.pi * step / ROUND_YAWS for step in range(ROUND_YAWS)]
        if rule.round
        else [closing_rad, closing_rad + math.pi]
    )
    return [
        Grasp(
            point_m=(centre_m[0], centre_m[1], centre_m[2] - height_m / 2 + above_bottom_m),
            yaw_rad=yaw,
            width_m=width_m,
            opening_m=min(width_m + 2 * OPENING_MARGIN_M, opening_max_m),
            effort_ratio=rule.effort_ratio,
            below_grip_m=above_bottom_m,
        )
        for yaw in yaws
    ]


def hand_down(
    point_m: tuple[float, float, float], yaw_rad: float, aside_m: float = 0.0
) -> NDArray[np.float64]:
    """Return the grip frame pointing straight down: z down, y the closing axis, x at `yaw_rad`.

    The point is `aside_m` along the closing axis from it: where a hand with one moving jaw has the
    middle of a thing.
    """
    cosine, sine = math.cos(yaw_rad), math.sin(yaw_rad)
    pose = np.eye(4)
    pose[:3, 0] = (cosine, sine, 0.0)
    pose[:3, 1] = (sine, -cosine, 0.0)
    pose[:3, 2] = (0.0, 0.0, -1.0)
    pose[:3, 3] = np.array(point_m) - aside_m * pose[:3, 1]
    return pose


def raised(pose: NDArray[np.float64], height_m: float) -> NDArray[np.float64]:
    """Return a pose that much higher."""
    higher = pose.copy()
    higher[2, 3] += height_m
    return higher
