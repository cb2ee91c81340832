"""Find the horizontal surfaces that things may stand on: the floor and table tops of any height."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import cv2
import numpy as np

from vla_deploy.perception.geometry.cloud import Cloud, Floats, Mask, upward_area

BIN_M = 0.01
LAYER_M = 0.015
MIN_AREA_M2 = 0.04
# Enough where a surface is known: the rest is hidden by what stands on it.
MIN_KNOWN_AREA_M2 = 0.01
SAME_LEVEL_M = 0.02
MAX_SUPPORTS = 6
CELL_M = 0.02
# What stands on a table hides a part of it, but does not cut it in two.
BRIDGED_CELLS = 15
FLOOR_M = 0.04
STRIDE = 2
FIT_POINTS = 2000
CORNER_M = 0.003
# Standard deviation of normal errors over the median of their sizes.
SIGMA_OF_MEDIAN = 1.4826
_FIT_ROUNDS = 3


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Support:
    """Hold one surface: z = a x + b y + c within a convex outline (n, 2) in the base frame.

    `uneven_m` is the standard deviation of its points from the plane: of a table that is the depth
    noise, of a pillow's top much more.
    """

    plane: tuple[float, float, float]
    outline: Floats
    is_floor: bool = False
    uneven_m: float = 0.0

    def height_m(self, x_m: float, y_m: float) -> float:
        """Return the surface's height above the floor at a point."""
        a, b, c = self.plane
        return a * x_m + b * y_m + c

    def heights_above(self, cloud: Cloud) -> Floats:
        """Return each pixel's height above the surface's plane."""
        a, b, c = self.plane
        above: Floats = cv2.transform(cloud.points, np.array([[-a, -b, 1.0, -c]], np.float32))
        return above


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class KnownSurface:
    """Hold a surface seen before: height above the floor and convex outline (n, 2), base frame."""

    height_m: float
    outline: Floats


def find_supports(
    cloud: Cloud, known: Sequence[KnownSurface] = (), floor_m: float | None = 0.0
) -> list[Support]:
    """Return the surfaces in view, the highest first.

    The floor is `floor_m` high in the base frame, None where the robot does not stand on it.
    """
    # Surfaces are large: every other pixel of every other row is plenty.
    area = upward_area(cloud, STRIDE) * np.float32(STRIDE**2)
    points = np.ascontiguousarray(cloud.points[::STRIDE, ::STRIDE])
    z = points[..., 2]
    supports: list[Support] = []
    left = area > 0.0
    for _ in range(MAX_SUPPORTS):
        level = _strongest_level(z[left], area[left], known)
        if level is None:
            break
        layer = left & (np.abs(z - level) < 2.0 * LAYER_M)
        plane = _fit_plane(points[layer], level)
        on_plane = left & (np.abs(_above(points, plane)) < LAYER_M)
        near = [one for one in known if abs(one.height_m - level) < SAME_LEVEL_M]
        pieces = _pieces(points, on_plane, area, plane, near)
        supports += [_named_floor(one, floor_m) for one in pieces]
        left &= ~(on_plane | (np.abs(z - level) < LAYER_M))
    return sorted(supports, key=lambda s: -s.height_m(*map(float, s.outline.mean(axis=0))))


def _named_floor(support: Support, floor_m: float | None) -> Support:
    x, y = (float(value) for value in support.outline.mean(axis=0))
    is_floor = floor_m is not None and abs(support.height_m(x, y) - floor_m) < FLOOR_M
    return replace(support, is_floor=is_floor)


def inside(outline: Floats, points: Floats, margin_m: float) -> Mask:
    """Return which of (n, 2 or 3) points lie within a convex outline widened by `margin_m`."""
    edges = np.roll(outline, -1, axis=0) - outline
    x, y = np.ascontiguousarray(points[:, 0]), np.ascontiguousarray(points[:, 1])
    within = np.ones(len(points), dtype=np.bool_)
    for (corner_x, corner_y), (edge_x, edge_y) in zip(outline, edges, strict=True):
        outwards = edge_y * x - edge_x * y
        corner = edge_y * corner_x - edge_x * corner_y
        within &= outwards < corner + margin_m * np.hypot(edge_x, edge_y)
    return within


def _strongest_level(z: Floats, area: Floats, known: Sequence[KnownSurface]) -> float | None:
    if not z.size:
        return None
    bins = np.floor(z / BIN_M).astype(np.int64)
    first = int(bins.min())
    # Padded: "same" would shift what is shorter than the kernel.
    bins_around = np.pad(np.bincount(bins - first, weights=area), 1)
    histogram = np.convolve(bins_around, np.ones(3), mode="valid")
    levels = (first + np.arange(histogram.size) + 0.5) * BIN_M
    needed = np.full(histogram.size, MIN_AREA_M2)
    for one in known:
        needed[np.abs(levels - one.height_m) < SAME_LEVEL_M] = MIN_KNOWN_AREA_M2
    enough = np.where(histogram >= needed, histogram, 0.0)
    best = int(np.argmax(enough))
    return float(levels[best]) if enough[best] > 0.0 else None


def _above(points: Floats, plane: tuple[float, float, float]) -> Floats:
    a, b, c = plane
    above: Floats = points[..., 2] - a * points[..., 0] - b * points[..., 1] - c
    return above


def _fit_plane(points: Floats, level: float) -> tuple[float, float, float]:
    """Fit a nearly level plane; small tilts are the camera's calibration errors."""
    plane = (0.0, 0.0, level)
    sample = points[:: max(1, len(points) // FIT_POINTS)]
    for _ in range(_FIT_ROUNDS):
        near = sample[np.abs(_above(sample, plane)) < LAYER_M].astype(np.float64)
        if len(near) < 30:
            break
        a, b, c = np.linalg.lstsq(
            np.column_stack((near[:, :2], np.ones(len(near)))), near[:, 2], rcond=None
        )[0]
        plane = (float(a), float(b), float(c))
    return plane


def _pieces(
    points: Floats,
    on_plane: Mask,
    area: Floats,
    plane: tuple[float, float, float],
    known: Sequence[KnownSurface],
) -> list[Support]:
    """Split the pixels of one plane into surfaces that do not touch."""
    xy = points[on_plane][:, :2]
    off_m = np.abs(_above(points[on_plane], plane))
    low = xy.min(axis=0)
    cells = ((xy - low) / CELL_M).astype(np.intp)
    grid = np.zeros(cells.max(axis=0) + 1, dtype=np.uint8)
    grid[cells[:, 0], cells[:, 1]] = 1
    grid = cv2.morphologyEx(
        grid, cv2.MORPH_CLOSE, np.ones((BRIDGED_CELLS, BRIDGED_CELLS), dtype=np.uint8)
    )
    _, labels = cv2.connectedComponents(grid, connectivity=8)
    label = labels[cells[:, 0], cells[:, 1]]
    areas = np.bincount(label, weights=area[on_plane])
    supports = []
    for index in np.flatnonzero(areas >= MIN_KNOWN_AREA_M2):
        member = label == index
        piece = xy[member]
        if areas[index] >= MIN_AREA_M2 or _is_on(piece, known):
            uneven_m = SIGMA_OF_MEDIAN * float(np.median(off_m[member]))
            supports.append(Support(plane=plane, outline=_outline(piece), uneven_m=uneven_m))
    return supports


def _is_on(piece: Floats, known: Sequence[KnownSurface]) -> bool:
    middle = np.median(piece, axis=0, keepdims=True)
    return any(bool(inside(one.outline, middle, 0.0)[0]) for one in known)


def _outline(xy: Floats) -> Floats:
    full = cv2.convexHull(np.ascontiguousarray(xy, dtype=np.float32))
    return counter_clockwise(cv2.approxPolyDP(full, CORNER_M, True).reshape(-1, 2))


def counter_clockwise(hull: Floats) -> Floats:
    """Return the corners of a convex outline in the order that `inside` needs."""
    x, y = hull.T
    area = float(np.dot(x, np.roll(y, -1)) - np.dot(y, np.roll(x, -1)))
    return hull if area > 0.0 else np.ascontiguousarray(hull[::-1])
