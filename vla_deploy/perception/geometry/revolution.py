"""Fit upright and lying bodies of revolution to a cluster: axis, radius and their error.

The camera sees the near side only, so the far side follows from the form: slices of an upright body
are circles, a lying one is a cylinder that touches its support. Yaw is that of a lying body's axis;
an upright one looks the same from all sides.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vla_deploy.perception.geometry.clusters import Cluster

Array = NDArray[np.float64]

SLICE_M = 0.008
SLICE_POINTS = 8
# Beyond this share of the radius a surface falls away from the camera too steeply.
FRONT_RATIO = 0.7
# A handle widens the slices that it is in; the narrower ones show the axis.
NARROW_SHARE = 0.4
NARROW_RATIO = 1.12
TOP_M = 0.006
PEAK_M = 0.004
PEAK_SHARE = 0.5
LYING_ROUNDS = 10
LYING_POINTS = 30
ON_SURFACE_SIGMAS = 3.0
ON_SURFACE_RATIO = 0.06


@dataclass(frozen=True, slots=True, kw_only=True)
class RevolutionFit:
    """Hold a body's axis in the base frame; sigmas are those of the place of its middle.

    `agreement` is the share of the points that lie on the fitted surface, 0 to 1.
    """

    xy: tuple[float, float]
    length_m: float
    radius_m: float
    yaw_rad: float
    sigma_xy_m: tuple[float, float]
    yaw_sigma_rad: float
    agreement: float


@dataclass(frozen=True, slots=True)
class _Slice:
    across_m: float
    along_m: float
    width_m: float
    points: int


def fit_upright(
    cluster: Cluster, camera_position: Array, pixel_m: float, sigma_m: float
) -> RevolutionFit | None:
    """Return the axis of an upright body of revolution, or None where too little of it is seen.

    `sigma_xy_m` is along the line of sight and across it.
    """
    origin, sight, across = sight_frame(cluster, camera_position)
    local = cluster.points[:, :2].astype(np.float64) - origin
    u, d, heights = local @ across, local @ sight, cluster.heights
    top_m = float(np.percentile(heights, 98.0))
    slices = _slices(u, d, heights, top_m, pixel_m, sigma_m)
    if not slices:
        return None
    kept = _narrow(slices)
    weights = np.array([one.points for one in kept], dtype=np.float64)
    middle_u, spread_u = _middle(np.array([one.across_m for one in kept]), weights)
    middle_d, spread_d = _middle(np.array([one.along_m for one in kept]), weights)
    radius_m = 0.5 * _middle(np.array([one.width_m for one in kept]), weights)[0]
    x, y = origin + middle_d * sight + middle_u * across
    return RevolutionFit(
        xy=(float(x), float(y)),
        length_m=top_m,
        radius_m=radius_m,
        yaw_rad=0.0,
        sigma_xy_m=(spread_d, spread_u),
        yaw_sigma_rad=math.inf,
        agreement=sum(one.points for one in kept) / sum(one.points for one in slices),
    )


def sight_frame(cluster: Cluster, camera_position: Array) -> tuple[Array, Array, Array]:
    """Return the middle of a cluster's points on the floor plan, and unit vectors there.

    The first points away from the camera, the second is a quarter turn left of it.
    """
    origin = cluster.points[:, :2].mean(axis=0, dtype=np.float64)
    away = origin - camera_position[:2]
    sight = away / max(float(np.linalg.norm(away)), 1e-6)
    return origin, sight, np.array([-sight[1], sight[0]])


def _slices(
    u: Array, d: Array, heights: NDArray[np.float32], top_m: float, pixel_m: float, sigma_m: float
) -> list[_Slice]:
    thick_m = max(SLICE_M, 1.5 * pixel_m)
    # The top face shows no side; it is looked at only where there is nothing else.
    highest_m = top_m - max(TOP_M, 2.0 * sigma_m)
    below = heights < highest_m
    if np.count_nonzero(below) < 2 * SLICE_POINTS:
        below = np.ones_like(below)
    numbers = (heights / thick_m).astype(np.intp)
    found = (
        _slice(u[member], d[member], pixel_m, sigma_m)
        for number in np.unique(numbers[below])
        if np.count_nonzero(member := below & (numbers == number)) >= SLICE_POINTS
    )
    return [one for one in found if one is not None]


def _slice(u: Array, d: Array, pixel_m: float, sigma_m: float) -> _Slice | None:
    """Return the circle of which the near side is seen, and perhaps the inside of the far one."""
    low, high = float(u.min()), float(u.max())
    middle, radius = 0.5 * (low + high), 0.5 * (high - low + pixel_m)
    front = np.abs(u - middle) < FRONT_RATIO * radius
    if np.count_nonzero(front) < SLICE_POINTS // 2:
        return None
    centres = d[front] + np.sqrt(radius**2 - (u[front] - middle) ** 2)
    along = _nearest_peak(centres, max(4.0 * sigma_m, PEAK_M))
    return _Slice(middle, along, 2.0 * radius, len(u))


def _nearest_peak(values: Array, window: float) -> float:
    """Return the mean of the first peak in the density of values."""
    ordered = np.sort(values)
    ends = np.searchsorted(ordered, ordered + window, side="right")
    counts = ends - np.arange(len(ordered))
    dense = np.flatnonzero(counts >= PEAK_SHARE * counts.max())
    # The fullest window of the peak, not the one that only touches it.
    near = dense[ordered[dense] <= ordered[dense[0]] + window]
    first = int(near[np.argmax(counts[near])])
    return float(ordered[first : ends[first]].mean())


def _narrow(slices: list[_Slice]) -> list[_Slice]:
    by_width = sorted(slices, key=lambda one: one.width_m)
    points = np.cumsum([one.points for one in by_width])
    at = int(np.searchsorted(points, NARROW_SHARE * points[-1]))
    limit = NARROW_RATIO * by_width[at].width_m
    return [one for one in slices if one.width_m <= limit]


def _middle(values: Array, weights: Array) -> tuple[float, float]:
    """Return the weighted mean without what is far off, and its standard error."""
    median = float(np.median(values))
    reach = 3.0 * max(1.5 * float(np.median(np.abs(values - median))), 0.001)
    near = np.abs(values - median) <= reach
    kept, kept_weights = values[near], weights[near]
    mean = float(np.average(kept, weights=kept_weights))
    spread = math.sqrt(float(np.average((kept - mean) ** 2, weights=kept_weights)))
    return mean, spread / math.sqrt(len(kept))


def fit_lying(
    cluster: Cluster, yaw_rad: float, pixel_m: float, sigma_m: float
) -> RevolutionFit | None:
    """Return the cylinder on its side that fits best, from a first estimate of its axis' yaw.

    `sigma_xy_m` is along the axis and across it. None means that no cylinder fits at all.
    """
    origin = cluster.points[:, :2].mean(axis=0, dtype=np.float64)
    xy = cluster.points[:, :2].astype(np.float64) - origin
    heights = cluster.heights.astype(np.float64)
    state = np.array([0.0, 0.5 * float(np.percentile(heights, 98.0)), yaw_rad])
    reach_m = 0.3 * state[1]
    solved = None
    for _ in range(LYING_ROUNDS):
        solved = _improved(state, xy, heights, max(reach_m, ON_SURFACE_SIGMAS * sigma_m))
        if solved is None:
            return None
        state, _, _ = solved
        reach_m = max(0.6 * reach_m, ON_SURFACE_RATIO * state[1])
    assert solved is not None
    _, covariance, near = solved
    return _as_lying(state, covariance, near, xy, origin, max(pixel_m, sigma_m))


def _improved(
    state: Array, xy: Array, heights: Array, reach_m: float
) -> tuple[Array, Array, NDArray[np.bool_]] | None:
    """Take one Gauss-Newton step in offset, radius and yaw; return state, covariance, inliers."""
    offset, radius, yaw = state
    c, s = math.cos(yaw), math.sin(yaw)
    along = xy @ (c, s)
    across = xy @ (-s, c) - offset
    above = heights - radius
    out = np.maximum(np.hypot(across, above), 1e-6)
    miss = out - radius
    near = np.abs(miss) < reach_m
    if np.count_nonzero(near) < LYING_POINTS:
        return None
    slope = np.column_stack((-across / out, -above / out - 1.0, -along * across / out))[near]
    normal = slope.T @ slope
    if np.linalg.cond(normal) > 1e12:
        return None
    step = np.linalg.solve(normal, -slope.T @ miss[near])
    fresh: Array = state + step
    if not 0.002 < fresh[1] < 0.3 or abs(step[2]) > 1.0:
        return None
    covariance = np.linalg.inv(normal) * float(np.mean(miss[near] ** 2))
    return fresh, covariance, near


def _as_lying(
    state: Array,
    covariance: Array,
    near: NDArray[np.bool_],
    xy: Array,
    origin: Array,
    grain_m: float,
) -> RevolutionFit:
    offset, radius, yaw = (float(value) for value in state)
    axis = np.array([math.cos(yaw), math.sin(yaw)])
    across = np.array([-math.sin(yaw), math.cos(yaw)])
    # The whole cluster counts here: a neck is thinner than the body, an end cap is no part of it.
    low, high = np.percentile(xy @ axis, (0.5, 99.5))
    x, y = origin + offset * across + 0.5 * (low + high) * axis
    return RevolutionFit(
        xy=(float(x), float(y)),
        length_m=float(high - low) + grain_m,
        radius_m=radius,
        yaw_rad=math.remainder(yaw, math.pi),
        sigma_xy_m=(0.5 * grain_m, math.sqrt(float(covariance[0, 0]))),
        yaw_sigma_rad=math.sqrt(float(covariance[2, 2])),
        agreement=float(np.mean(near)),
    )
