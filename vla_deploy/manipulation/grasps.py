"""Choose how to grasp: where the fingers go, how wide they open, how hard they press."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum
from types import MappingProxyType
from typing import Final

import numpy as np
from numpy.typing import NDArray

from vla_deploy.manipulation.errors import NotFromSide, TooWide
from vla_deploy.robots import RobotDescription


class GraspKind(StrEnum):
    """Name the directions from which a hand comes to a thing."""

    TOP = "top"
    SIDE = "side"


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
# From the side: the hand lies, its closing axis level. It takes things that stand: at half their
# height, where they do not tip, but so high that wrist and palm (27 mm at most, of the hands that
# come with the stack) clear the support, and so low that the fingers' breadth is below the top.
SIDE_JOINTS: Final = 6
"""Of an arm that brings its hand to a place at any heading."""
STANDS_RATIO: Final = 1.2
"""Of height to width."""
ROUND_RATIO: Final = 1.3
"""Of length to width, at most, of an unknown thing that may be round."""
HAND_ABOVE_SUPPORT_M: Final = 0.045
BELOW_TOP_M: Final = 0.02
SIDE_HEIGHT_RATIO: Final = 0.5
DEEPER_M: Final = 0.006
"""So far past the middle of a thing: its place along the hand is seen worst."""
CLEAR_OF_THING_M: Final = 0.02
SIDE_TILTS_RAD: Final = tuple(math.radians(degrees) for degrees in (90.0, 65.0, 45.0))
"""Of the hand from straight down: level, or inclined where the arm needs it; the plainest first."""
SIDE_TURNS_RAD: Final = tuple(math.radians(degrees) for degrees in (0, 30, -30, 60, -60, 90, -90))
"""Of the way in from the bearing of the thing as its arm's shoulder sees it."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Grasp:
    """Give one grasp: the grip pose's point, yaw and tilt, and the fingers' openings.

    `tilt_rad` is the hand's angle from straight down, 0 from above; see `hand_at`. `way_in_m` is
    how far the hand comes in along its own axis, 0 where it goes straight down.
    """

    point_m: tuple[float, float, float]
    yaw_rad: float
    width_m: float
    opening_m: float
    effort_ratio: float
    below_grip_m: float
    tilt_rad: float = 0.0
    way_in_m: float = 0.0

    @property
    def kind(self) -> GraspKind:
        """Return from where the hand comes."""
        return GraspKind.TOP if self.tilt_rad == 0.0 else GraspKind.SIDE


def _rule_of(kind: str) -> GraspRule:
    return GRASP_RULES.get(kind, GRASP_RULES["object"])


def require_fit(
    kind: str, size_m: tuple[float, float, float], opening_max_m: float, doubt_m: float = 0.0
) -> float:
    """Return how wide an object is between the fingers.

    Raises:
        TooWide: it is wider than they open, by more than `doubt_m`.
    """
    rule = _rule_of(kind)
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
    rule = _rule_of(kind)
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


def takes_from_side(robot: RobotDescription, hand: str) -> bool:
    """Return whether a hand turns to every side: with fewer joints it points where its arm does."""
    return len(robot.group(robot.hands[hand].arm).joints) >= SIDE_JOINTS


def shape_refusal(kind: str) -> str:
    """Return why no thing of a kind is grasped from the side, "" where its size decides."""
    rule = _rule_of(kind)
    if rule.round or rule is GRASP_RULES["object"]:
        return ""
    return f"a {kind} is not round; from the side I take bottles, cans, cups and the like"


def side_refusal(kind: str, size_m: tuple[float, float, float], doubt_m: float = 0.0) -> str:
    """Return why a thing is not grasped from the side, "" where it is: it stands and is round.

    It may be narrower by `doubt_m` than it is seen.
    """
    length_m, across_m, height_m = size_m
    rule = _rule_of(kind)
    widest_m, narrow_m = max(length_m, across_m), min(length_m, across_m)
    if why := shape_refusal(kind):
        return why
    if not rule.round and widest_m > ROUND_RATIO * narrow_m:
        return f"the {kind} is not round: {widest_m * 1000:.0f} mm by {narrow_m * 1000:.0f}"
    least_m = max(HAND_ABOVE_SUPPORT_M + BELOW_TOP_M, STANDS_RATIO * (widest_m - doubt_m))
    if height_m < least_m:
        return (
            f"the {kind} is {height_m * 1000:.0f} mm high; from the side I take what is "
            f"{least_m * 1000:.0f} mm or more"
        )
    return ""


def side_grip_m(size_m: tuple[float, float, float]) -> float:
    """Return how high above its bottom a thing is gripped from the side."""
    height_m = size_m[2]
    return min(max(SIDE_HEIGHT_RATIO * height_m, HAND_ABOVE_SUPPORT_M), height_m - BELOW_TOP_M)


def grasps_from_side(
    kind: str,
    centre_m: tuple[float, float, float],
    size_m: tuple[float, float, float],
    shoulder_m: Sequence[float] | NDArray[np.float64],
    opening_max_m: float,
    tilt_rad: float = SIDE_TILTS_RAD[0],
) -> list[Grasp]:
    """Return the grasps of a standing thing by a hand at that tilt, the plainest way in first.

    The hand comes from the side of `shoulder_m`; each way in is there twice, for a hand that is
    turned over.

    Raises:
        NotFromSide: it is not round, or too low.
        TooWide: it is wider than the fingers open.
    """
    if why := side_refusal(kind, size_m):
        raise NotFromSide(why)
    width_m = require_fit(kind, size_m, opening_max_m)
    above_bottom_m = side_grip_m(size_m)
    bearing_rad = math.atan2(centre_m[1] - shoulder_m[1], centre_m[0] - shoulder_m[0])
    middle = np.array((*centre_m[:2], centre_m[2] - size_m[2] / 2 + above_bottom_m))
    effort_ratio, found = _rule_of(kind).effort_ratio, []
    for turn_rad in SIDE_TURNS_RAD:
        heading_rad = bearing_rad + turn_rad
        ahead = np.array((math.cos(heading_rad), math.sin(heading_rad), 0.0))
        x_m, y_m, z_m = (middle + DEEPER_M * ahead).tolist()
        for is_over in (False, True):
            grasp = Grasp(
                point_m=(x_m, y_m, z_m),
                yaw_rad=heading_rad + (math.pi if is_over else 0.0),
                width_m=width_m,
                opening_m=min(width_m + 2 * OPENING_MARGIN_M, opening_max_m),
                effort_ratio=effort_ratio,
                below_grip_m=above_bottom_m,
                tilt_rad=-tilt_rad if is_over else tilt_rad,
                way_in_m=DEEPER_M + TIP_BEYOND_GRIP_M + width_m / 2 + CLEAR_OF_THING_M,
            )
            found.append(grasp)
    return found


def hand_at(
    point_m: tuple[float, float, float], yaw_rad: float, tilt_rad: float, aside_m: float = 0.0
) -> NDArray[np.float64]:
    """Return the grip frame of a hand that is tilted up from straight down, towards `yaw_rad`.

    A negative tilt is that of a hand turned over: it points to the other side, and what it holds
    upright is upright by the opposite end. What stands in a hand does so at every yaw.
    """
    pose = hand_down(point_m, yaw_rad, aside_m)
    cosine, sine = math.cos(tilt_rad), math.sin(tilt_rad)
    x_axis, z_axis = pose[:3, 0].copy(), pose[:3, 2].copy()
    pose[:3, 0] = cosine * x_axis - sine * z_axis
    pose[:3, 2] = sine * x_axis + cosine * z_axis
    return pose


def drawn_back(pose: NDArray[np.float64], distance_m: float) -> NDArray[np.float64]:
    """Return a pose that much farther back along the hand's own axis."""
    back = pose.copy()
    back[:3, 3] -= distance_m * pose[:3, 2]
    return back


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
