"""Segment what stands on a support into separate things."""

from collections.abc import Iterable
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from vla_deploy.perception.geometry.cloud import Cloud, Floats, Mask
from vla_deploy.perception.geometry.outline import judge_outline
from vla_deploy.perception.geometry.supports import Support, inside
from vla_deploy.perception.naming.colour import colour_names

# From the first height on it is a thing; what adjoins it belongs to it from the second on.
MIN_HEIGHT_M, EDGE_HEIGHT_M = 0.004, 0.002
# Rugs and thresholds are floor.
MIN_HEIGHT_ON_FLOOR_M = 0.012
NOISE_SIGMAS, EDGE_SIGMAS = 2.5, 1.5
MAX_HEIGHT_M = 0.42
OUTLINE_MARGIN_M = 0.02
HIGHER_MARGIN_M = 0.05
MAX_EXTENT_M = 0.55
FLOATING_M = 0.08
MIN_PIXELS = 14
# Things are apart whose gap, seen from above, is wider than two cells; up close pixels are denser.
CLOSE_CELL_M, NEAR_CELL_M, FAR_CELL_M = 0.005, 0.01, 0.02
CLOSE_M, NEAR_M = 0.65, 1.5
OCCLUDER_M = 0.05
OCCLUDED_SHARE = 0.2
TOP_HIDDEN_SHARE = 0.5
# Of a thing's left or right edge: a hand may hide a third of a box and little of its outline.
END_HIDDEN_SHARE = 0.3
PART_SHARE = 0.15
OUTLINE_PX = 3


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Cluster:
    """Hold one thing's visible points.

    `truncated` means that the image's border or something nearer hides its end or its top, so that
    no measure holds; `occluded` that something nearer hides a part of its side.
    """

    support: Support
    points: Floats
    heights: Floats
    rgb: NDArray[np.uint8]
    pixels: NDArray[np.intp]
    depth_m: float
    box_px: tuple[int, int, int, int]
    truncated: bool
    occluded: bool

    def upper(self) -> Mask:
        """Return which points surely stand up; a low edge may show the support."""
        upper: Mask = self.heights > MIN_HEIGHT_M
        return upper if np.count_nonzero(upper) >= MIN_PIXELS else np.ones_like(upper)


@dataclass(frozen=True, slots=True, kw_only=True)
class _Hidden:
    """Hold how much of the outline, its top and its worse end borders on something nearer."""

    outline: float
    top: float
    end: float


def find_clusters(cloud: Cloud, supports: list[Support]) -> list[Cluster]:
    """Return the clusters on each support, without furniture and walls, or parts of them."""
    clusters: list[Cluster] = []
    flat_points = cloud.points.reshape(-1, 3)
    for index, support in enumerate(supports):
        heights = cv2.medianBlur(support.heights_above(cloud), 3)
        standing = np.flatnonzero(cloud.valid & _stands_up(heights, cloud, support))
        standing = standing[inside(support.outline, flat_points[standing], OUTLINE_MARGIN_M)]
        for higher in supports[:index]:
            standing = standing[~_belongs_to(higher, support, flat_points[standing])]
        found = _split(cloud, support, heights, standing)
        clusters += [one for one in found if not judge_outline(cloud, heights, one.pixels).is_part]
    return clusters


def _stands_up(heights: Floats, cloud: Cloud, support: Support) -> Mask:
    """Return which pixels are higher than their support, with the low edges of what is higher."""
    lowest_m = MIN_HEIGHT_ON_FLOOR_M if support.is_floor else MIN_HEIGHT_M
    sigma_m: Floats = np.maximum(cloud.sigma_m(), support.uneven_m)
    surely: Mask = heights > np.maximum(lowest_m, NOISE_SIGMAS * sigma_m)
    if support.is_floor:
        return surely
    barely = (heights > np.maximum(EDGE_HEIGHT_M, EDGE_SIGMAS * sigma_m)).astype(np.uint8)
    _, parts = cv2.connectedComponents(barely, connectivity=8)
    counts = np.bincount(parts[surely], minlength=int(parts.max()) + 1)
    things = counts >= MIN_PIXELS
    things[0] = False
    return surely | things[parts]


def _belongs_to(higher: Support, lower: Support, points: Floats) -> Mask:
    """Return which points are part of, under, or on a higher surface."""
    if np.allclose(higher.plane, lower.plane):
        return np.zeros(len(points), dtype=np.bool_)
    return inside(higher.outline, points, HIGHER_MARGIN_M)


def _split(
    cloud: Cloud, support: Support, heights: Floats, standing: NDArray[np.intp]
) -> list[Cluster]:
    if standing.size < MIN_PIXELS:
        return []
    rows, columns = np.unravel_index(standing, heights.shape)
    points = cloud.points[rows, columns]
    depth_m = float(np.median(cloud.depth_m[rows, columns]))
    labels = _label(points[:, :2], heights[rows, columns], _cell_m(depth_m))
    clusters = []
    for label in np.flatnonzero(np.bincount(labels) >= MIN_PIXELS):
        if label == 0:
            continue
        member = labels == label
        extent = np.ptp(points[member][:, :2], axis=0)
        # What floats above the support is carried by a hand, or is a part of the robot.
        lowest_m = float(np.percentile(heights[rows[member], columns[member]], 5.0))
        if extent.max() < MAX_EXTENT_M and lowest_m < FLOATING_M:
            clusters.append(_cluster(cloud, support, heights, standing[member]))
    return clusters


def _cell_m(depth_m: float) -> float:
    if depth_m < CLOSE_M:
        return CLOSE_CELL_M
    return NEAR_CELL_M if depth_m < NEAR_M else FAR_CELL_M


def _label(xy: Floats, heights: Floats, cell_m: float) -> NDArray[np.int32]:
    """Number the points by connected cells seen from above; 0 marks what is too tall."""
    cells = ((xy - xy.min(axis=0)) / cell_m).astype(np.intp) + 1
    grid = np.zeros(cells.max(axis=0) + 2, dtype=np.uint8)
    grid[cells[:, 0], cells[:, 1]] = 1
    closed = cv2.morphologyEx(grid, cv2.MORPH_CLOSE, np.ones((3, 3), dtype=np.uint8))
    _, labels = cv2.connectedComponents(closed, connectivity=8)
    numbered: NDArray[np.int32] = labels[cells[:, 0], cells[:, 1]]
    too_tall = np.unique(numbered[heights > MAX_HEIGHT_M])
    numbered[np.isin(numbered, too_tall)] = 0
    return numbered


def split_apart(cluster: Cluster, cloud: Cloud, member: Mask) -> list[Cluster]:
    """Split a part of a cluster into what does not touch, seen from above; drop the small rest."""
    chosen = np.flatnonzero(member)
    if chosen.size < MIN_PIXELS:
        return []
    xy, heights = cluster.points[chosen, :2], cluster.heights[chosen]
    labels = _label(xy, heights, _cell_m(cluster.depth_m))
    numbers = np.flatnonzero(np.bincount(labels) >= MIN_PIXELS)
    return _parts(cluster, cloud, (chosen[labels == number] for number in numbers))


def split_by_colour(cluster: Cluster, cloud: Cloud) -> list[Cluster]:
    """Return the parts of a cluster that differ in colour: things that touch."""
    names = colour_names(cluster.rgb)
    counts = np.bincount(names)
    large = np.flatnonzero(counts >= max(MIN_PIXELS, PART_SHARE * names.size))
    if large.size < 2:
        return [cluster]
    return _parts(cluster, cloud, (np.flatnonzero(names == name) for name in large))


def _parts(cluster: Cluster, cloud: Cloud, parts: Iterable[NDArray[np.intp]]) -> list[Cluster]:
    """Return clusters of some of a cluster's points each, given by their indices."""
    heights = np.zeros(cloud.depth_m.shape, dtype=np.float32)
    heights.flat[cluster.pixels] = cluster.heights
    return [_cluster(cloud, cluster.support, heights, cluster.pixels[part]) for part in parts]


def _cluster(cloud: Cloud, support: Support, heights: Floats, pixels: NDArray[np.intp]) -> Cluster:
    height, width = cloud.depth_m.shape
    rows, columns = np.unravel_index(pixels, heights.shape)
    box = (int(columns.min()), int(rows.min()), int(columns.max()) + 1, int(rows.max()) + 1)
    at_border = box[0] <= 1 or box[1] <= 1 or box[2] >= width - 1 or box[3] >= height - 1
    hidden = _hidden_shares(cloud, rows, columns)
    return Cluster(
        support=support,
        points=cloud.points[rows, columns],
        heights=heights[rows, columns],
        rgb=cloud.rgb[rows, columns],
        pixels=pixels,
        depth_m=float(np.median(cloud.depth_m[rows, columns])),
        box_px=box,
        truncated=at_border or hidden.top > TOP_HIDDEN_SHARE,
        occluded=hidden.outline > OCCLUDED_SHARE or hidden.end > END_HIDDEN_SHARE,
    )


def _hidden_shares(cloud: Cloud, rows: NDArray[np.intp], columns: NDArray[np.intp]) -> _Hidden:
    top, left = max(0, int(rows.min()) - OUTLINE_PX), max(0, int(columns.min()) - OUTLINE_PX)
    around = np.s_[
        top : int(rows.max()) + OUTLINE_PX + 1, left : int(columns.max()) + OUTLINE_PX + 1
    ]
    depth_m = cloud.depth_m[around]
    member = np.zeros(depth_m.shape, dtype=np.uint8)
    member[rows - top, columns - left] = 1
    kernel = np.ones((5, 5), dtype=np.uint8)
    ring = (cv2.dilate(member, kernel) - member).astype(np.bool_)
    beside = cv2.dilate(np.where(member > 0, depth_m, 0.0).astype(np.float32), kernel)
    nearer = cloud.own_body[around] | ((depth_m > 0.0) & (depth_m < beside - OCCLUDER_M))
    above, left, right = (np.zeros_like(ring) for _ in range(3))
    above[:-2] = member[2:] > 0
    highest = above & ring
    highest[int(rows.min()) - top :] = False
    left[:, :-2] = member[:, 2:] > 0
    right[:, 2:] = member[:, :-2] > 0
    return _Hidden(
        outline=_share(nearer, ring),
        top=max(_share(nearer, above & ring), _share(nearer, highest)),
        end=max(_share(nearer, left & ring), _share(nearer, right & ring)),
    )


def _share(part: Mask, whole: Mask) -> float:
    count = int(np.count_nonzero(whole))
    return int(np.count_nonzero(part & whole)) / count if count else 0.0
