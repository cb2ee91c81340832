"""Measure size and form of a cluster of points."""

import math
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from vla_deploy.perception.geometry.cloud import DEPTH_SIGMA_PER_M, Floats, Mask
from vla_deploy.perception.geometry.clusters import Cluster

TOP_SLICE_M = 0.012
TOP_SLICE_RATIO = 0.12
RIM_MARGIN_M = 0.035
SOLID_SHARE = 0.2
SECTORS = 16
SPHERE_MIN_HEIGHT_M = 0.006

Point = NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True)
class Rectangle:
    """Hold the tightest rectangle around points on the floor plan; length >= width.

    `fill_ratio` is the share of it that the points' convex hull covers: 1 for what is rectangular.
    """

    centre: tuple[float, float]
    length_m: float
    width_m: float
    yaw_rad: float
    fill_ratio: float = 1.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Sphere:
    """Hold a fitted sphere and how far the points are off it, beyond the depth noise."""

    centre: tuple[float, float, float]
    radius_m: float
    residual_ratio: float


@dataclass(frozen=True, slots=True, kw_only=True)
class MeasuredShape:
    """Hold the measures that the class rules look at.

    `across_m` is the width as seen from the camera, of which nothing is hidden. `hole_m` is how far
    the inside lies below the rim, 0 without a rim; `rim_share` is the share of directions from the
    middle in which a rim is seen. `sphere` is None where none fits. `whole` is the rectangle around
    low edges, too, such as the rings and blades of keys, which the other measures leave out.
    """

    height_m: float
    across_m: float
    footprint: Rectangle
    whole: Rectangle
    top: Rectangle
    hole_m: float
    rim_share: float
    sphere: Sphere | None


def measure(cluster: Cluster, camera_position: Point, focal_px: float) -> MeasuredShape:
    """Measure one cluster."""
    pixel_m = cluster.depth_m / focal_px
    sigma_m = DEPTH_SIGMA_PER_M * cluster.depth_m**2
    height_m = float(np.percentile(cluster.heights, 98.0))
    every = cluster.points[:, :2]
    upper = cluster.upper()
    xy = every[upper]
    slice_m = max(TOP_SLICE_M, TOP_SLICE_RATIO * height_m)
    rim = every[cluster.heights > height_m - slice_m]
    top = rectangle_of(rim)
    return MeasuredShape(
        height_m=height_m,
        across_m=_across(xy, camera_position) + pixel_m,
        footprint=rectangle_of(xy),
        whole=rectangle_of(every),
        top=top,
        hole_m=_hole(cluster, top, height_m, pixel_m),
        rim_share=_share_around(rim, top),
        sphere=_sphere(cluster.points[cluster.heights > SPHERE_MIN_HEIGHT_M], sigma_m),
    )


def rectangle_of(xy: Floats) -> Rectangle:
    """Return the tightest rectangle around (n, 2) points.

    Each side rests on its outermost pixel of many, so that no half pixel is missing there.
    """
    # Around their mean and in millimetres: OpenCV computes in single precision.
    mean = xy.mean(axis=0, dtype=np.float64)
    local = ((xy - mean) * 1000.0).astype(np.float32)
    (x, y), (first, second), angle_deg = cv2.minAreaRect(local)
    length, width, angle_deg = (
        (first, second, angle_deg) if first >= second else (second, first, angle_deg + 90.0)
    )
    return Rectangle(
        centre=(float(mean[0] + x / 1000.0), float(mean[1] + y / 1000.0)),
        length_m=length / 1000.0,
        width_m=width / 1000.0,
        yaw_rad=half_turn(math.radians(angle_deg)),
        fill_ratio=cv2.contourArea(cv2.convexHull(local)) / max(length * width, 1e-6),
    )


def half_turn(angle_rad: float) -> float:
    """Return the direction of an axis, which looks the same after half a turn: (-pi/2, pi/2]."""
    return math.pi / 2 - (math.pi / 2 - angle_rad) % math.pi


def _across(xy: Floats, camera_position: Point) -> float:
    """Return the extent at right angles to the line of sight."""
    sight = xy.mean(axis=0) - camera_position[:2]
    across = np.array([-sight[1], sight[0]]) / max(float(np.linalg.norm(sight)), 1e-6)
    low, high = np.percentile(xy @ across, (1.0, 99.0))
    return float(high - low)


def inside_rectangle(xy: Floats, rectangle: Rectangle, margin_m: float) -> Mask:
    """Return which of (n, 2) points lie at least `margin_m` inside a rectangle."""
    c, s = math.cos(rectangle.yaw_rad), math.sin(rectangle.yaw_rad)
    half = 0.5 * np.array([rectangle.length_m, rectangle.width_m]) - margin_m
    local = np.abs((xy - rectangle.centre) @ np.array([[c, -s], [s, c]]))
    within: Mask = np.all(local < half, axis=1)
    return within


def _hole(cluster: Cluster, rim: Rectangle, height_m: float, pixel_m: float) -> float:
    """Return how deep the middle lies below the rim around it."""
    length_m, width_m = rim.length_m - 2.0 * RIM_MARGIN_M, rim.width_m - 2.0 * RIM_MARGIN_M
    if min(length_m, width_m) <= 0.0:
        return 0.0
    middle = cluster.heights[inside_rectangle(cluster.points[:, :2], rim, RIM_MARGIN_M)]
    if middle.size < SOLID_SHARE * length_m * width_m / pixel_m**2:
        # A lid would fill the middle with points: the support is seen instead.
        return height_m
    return max(0.0, height_m - float(np.median(middle)))


def _share_around(rim: Floats, rectangle: Rectangle) -> float:
    """Return the share of directions, seen from a rectangle's middle, in which there is a point."""
    x, y = (rim - rectangle.centre).T
    sectors = ((np.arctan2(y, x) + np.pi) * (SECTORS / (2.0 * np.pi))).astype(np.intp) % SECTORS
    return len(np.unique(sectors)) / SECTORS


def _sphere(points: Floats, sigma_m: float) -> Sphere | None:
    """Fit a sphere by linear least squares on |p|^2 = 2 c p + k."""
    if len(points) < 12:
        return None
    mean = points.mean(axis=0, dtype=np.float64)
    local = points.astype(np.float64) - mean
    system = np.column_stack((2.0 * local, np.ones(len(local))))
    solution, _, rank, _ = np.linalg.lstsq(system, (local**2).sum(axis=1), rcond=None)
    square = float(solution[3] + solution[:3] @ solution[:3])
    if rank < 4 or square <= 0.0:
        return None
    radius_m = math.sqrt(square)
    off = np.linalg.norm(local - solution[:3], axis=1) - radius_m
    x, y, z = solution[:3] + mean
    return Sphere(
        centre=(float(x), float(y), float(z)),
        radius_m=radius_m,
        residual_ratio=math.sqrt(max(0.0, float(np.mean(off**2)) - sigma_m**2)) / radius_m,
    )
