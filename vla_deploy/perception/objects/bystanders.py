"""Place the people and chairs that the detector finds: obstacles, never things to take.

A box gives only a direction. The depth image says how far away it is, and whether it is of a
person's or a chair's size at all; a box for which it is not is dropped.
"""

from dataclasses import dataclass
from typing import Final

import numpy as np

from vla_deploy.ipc.payloads.scene import BystanderDocument
from vla_deploy.perception.geometry.cloud import Cloud, Floats
from vla_deploy.perception.images.network_view import NetworkView
from vla_deploy.perception.naming.classes import BYSTANDERS, Range
from vla_deploy.robots.floor_pose import Pose2D

LEAST_CHANCE: Final = 0.3
"""Low, because an obstacle too many costs little."""
MIDDLE: Final = 0.6
"""Share of a box, each way, in which its thing is looked for: around the edges is background."""
LEAST_DEPTH_SHARE: Final = 0.2
NEAR_PERCENTILE: Final = 20.0
REACH_M: Final = 0.6
ABOVE_FLOOR_M: Final = 0.08
TOP_M: Final[dict[str, Range]] = {"person": (0.5, 2.3), "chair": (0.3, 1.5)}
WIDEST_M: Final = 1.3


@dataclass(frozen=True, slots=True, kw_only=True)
class Bystander:
    """Hold one obstacle in the map: the middle of what is seen of it, its width and its top."""

    class_name: str
    x_m: float
    y_m: float
    width_m: float
    top_m: float
    confidence: float

    def document(self) -> BystanderDocument:
        """Return the obstacle for the scene topic."""
        return {
            "class": self.class_name,
            "position_m": [round(self.x_m, 3), round(self.y_m, 3)],
            "width_m": round(self.width_m, 3),
            "top_m": round(self.top_m, 3),
            "confidence": round(self.confidence, 3),
        }


def find_bystanders(cloud: Cloud, network: NetworkView | None, base: Pose2D) -> list[Bystander]:
    """Return the people and chairs in an image, the surest first; `base` is the robot's pose."""
    if network is None:
        return []
    found = [
        _place(cloud, corners_px, vote.class_name, vote.chance, base)
        for corners_px, vote in network.sure_votes(BYSTANDERS)
        if vote.chance >= LEAST_CHANCE
    ]
    return [one for one in found if one is not None]


def _place(
    cloud: Cloud, corners_px: Floats, class_name: str, chance: float, base: Pose2D
) -> Bystander | None:
    points = _front(cloud, corners_px)
    if points is None:
        return None
    low, high = np.percentile(points, (2.0, 98.0), axis=0)
    width_m, top_m = float(np.hypot(*(high - low)[:2])), float(high[2])
    lowest_m, highest_m = TOP_M[class_name]
    if not lowest_m <= top_m <= highest_m or width_m > WIDEST_M:
        return None
    x, y = (float(value) for value in np.median(points[:, :2], axis=0))
    x_m, y_m = base.outward(x, y)
    return Bystander(
        class_name=class_name,
        x_m=x_m,
        y_m=y_m,
        width_m=width_m,
        top_m=top_m,
        confidence=chance,
    )


def _front(cloud: Cloud, corners_px: Floats) -> Floats | None:
    """Return the nearest body of points in the middle of a box, or None where there is none."""
    left, top, right, bottom = corners_px
    shrink_x, shrink_y = (0.5 * (1.0 - MIDDLE) * size for size in (right - left, bottom - top))
    middle = np.s_[
        int(top + shrink_y) : int(bottom - shrink_y) + 1,
        int(left + shrink_x) : int(right - shrink_x) + 1,
    ]
    standing = cloud.valid[middle] & (cloud.points[middle][..., 2] > ABOVE_FLOOR_M)
    if np.count_nonzero(standing) < LEAST_DEPTH_SHARE * standing.size:
        return None
    depth_m = cloud.depth_m[middle]
    near_m = float(np.percentile(depth_m[standing], NEAR_PERCENTILE))
    front: Floats = cloud.points[middle][standing & (np.abs(depth_m - near_m) < REACH_M)]
    return front
