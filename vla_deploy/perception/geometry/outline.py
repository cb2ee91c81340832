"""Judge the outline of a cluster in the image: does it end there, or does its surface go on?

A thing ends all around: at the support that it stands on, at an edge in depth with something
further away behind it, or in a concave crease where it touches something else. A part of something
larger does not: a piece of a sofa's back or the edge of a pillow goes on, in depth, into what is
not of the cluster.
"""

from dataclasses import dataclass
from typing import Any, Final

import cv2
import numpy as np
from numpy.typing import NDArray

from vla_deploy.perception.geometry.cloud import Cloud, Floats, Mask

# A pixel beside the outline may show both sides, so one further out is looked at.
STEP_PX: Final = 2
MARGIN_PX: Final = 2 * STEP_PX
# Nearer to its plane than this, or than the depth noise, a pixel shows the support.
ON_SUPPORT_M: Final = 0.008
SUPPORT_SIGMAS: Final = 2.5
# Steps in depth and bends that are larger than the noise of their two or three pixels.
EDGE_M: Final = 0.02
EDGE_SIGMAS: Final = 4.0
CREASE_M: Final = 0.01
CREASE_SIGMAS: Final = 2.0
# On the twin's tours nearly all things go on along less than 0.1 of their outline, a table's side
# from 0.17 on; a few bowls of random scenes reach 0.24 and are missed.
PART_SHARE: Final = 0.15
DIRECTIONS: Final = ((-1, 0), (1, 0), (0, -1), (0, 1))
_CLOSING: Final = np.ones((3, 3), dtype=np.uint8)


@dataclass(frozen=True, slots=True, kw_only=True)
class Outline:
    """Count an outline's pixels by what is next to them.

    Those that something nearer hides, or that have no depth, prove nothing and are left out.
    """

    ends: int
    goes_on: int

    @property
    def is_part(self) -> bool:
        """Return whether this is a part of something larger."""
        return self.goes_on > PART_SHARE * (self.ends + self.goes_on)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Window:
    """Hold what is around a cluster (h, w): the depth is 0 where none is known."""

    member: Mask
    depth_m: Floats
    sigma_m: Floats
    on_support: Mask


def judge_outline(cloud: Cloud, heights: Floats, pixels: NDArray[np.intp]) -> Outline:
    """Return the outline of a cluster of pixels; `heights` (h, w) are those above its support."""
    window = _window(cloud, heights, pixels)
    counts = np.sum([_count(window, direction) for direction in DIRECTIONS], axis=0)
    return Outline(ends=int(counts[0]), goes_on=int(counts[1]))


def _window(cloud: Cloud, heights: Floats, pixels: NDArray[np.intp]) -> _Window:
    rows, columns = np.unravel_index(pixels, cloud.depth_m.shape)
    top, left = max(0, int(rows.min()) - MARGIN_PX), max(0, int(columns.min()) - MARGIN_PX)
    around = np.s_[top : int(rows.max()) + MARGIN_PX + 1, left : int(columns.max()) + MARGIN_PX + 1]
    depth_m = np.where(cloud.own_body[around], np.float32(0.0), cloud.depth_m[around])
    member = np.zeros(depth_m.shape, dtype=np.uint8)
    member[rows - top, columns - left] = 1
    sigma_m = cloud.sigma_m()[around]
    return _Window(
        member=cv2.morphologyEx(member, cv2.MORPH_CLOSE, _CLOSING) > 0,
        depth_m=depth_m,
        sigma_m=sigma_m,
        on_support=np.abs(heights[around]) < np.maximum(ON_SUPPORT_M, SUPPORT_SIGMAS * sigma_m),
    )


def _count(window: _Window, direction: tuple[int, int]) -> tuple[int, int]:
    """Return how many pixels of the outline end, and how many go on, in a direction."""
    depth_m = window.depth_m
    edge = window.member & ~_ahead(window.member, direction, 1) & (depth_m > 0.0)
    here_m, sigma_m = depth_m[edge], window.sigma_m[edge]
    inner_m = np.where(window.member, depth_m, 0.0)
    before_m, next_m, after_m = (
        _ahead(values, direction, steps)[edge]
        for values, steps in ((inner_m, -STEP_PX), (depth_m, STEP_PX), (depth_m, 2 * STEP_PX))
    )
    step_m = next_m - here_m
    # A surface seen at a grazing angle is no edge: what follows is as steep.
    slope_m = np.where(after_m > 0.0, after_m - next_m, 0.0)
    jump_m = step_m - np.clip(slope_m, np.minimum(step_m, 0.0), np.maximum(step_m, 0.0))
    least_m = np.maximum(EDGE_M, EDGE_SIGMAS * sigma_m)
    # In a concave crease it turns towards the camera; the far side of a convex edge is still of it.
    bend_m = np.where(before_m > 0.0, here_m - before_m - step_m, 0.0)
    is_crease = bend_m > np.maximum(CREASE_M, CREASE_SIGMAS * sigma_m)
    is_seen = (next_m > 0.0) & (jump_m > -least_m)
    ends = _ahead(window.on_support, direction, STEP_PX)[edge] | (jump_m > least_m) | is_crease
    return int(np.count_nonzero(is_seen & ends)), int(np.count_nonzero(is_seen & ~ends))


def _ahead(values: NDArray[Any], direction: tuple[int, int], steps: int) -> NDArray[Any]:
    """Return for each pixel the value some steps ahead; beyond the border there is nothing."""
    down, right = direction[0] * steps, direction[1] * steps
    height, width = values.shape
    moved = np.zeros_like(values)
    moved[max(0, -down) : height - max(0, down), max(0, -right) : width - max(0, right)] = values[
        max(0, down) : height - max(0, -down), max(0, right) : width - max(0, -right)
    ]
    return moved
