"""Compare what things cover of the floor plan: rectangles along their yaw, or circles."""

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from vla_deploy.world.thing import Thing

# Of what is nearly as long as wide the yaw says nothing: it is taken as round.
ROUND_RATIO = 0.9


def is_round(thing: Thing) -> bool:
    """Return whether a thing covers a circle rather than a rectangle."""
    length_m, width_m, _ = thing.size_m
    return thing.kind != "box" and min(length_m, width_m) >= ROUND_RATIO * max(length_m, width_m)


def depth_inside_m(point_m: Sequence[float], thing: Thing) -> float:
    """Return how far a point of the plan lies within a thing's footprint; outside, negative."""
    if is_round(thing):
        return 0.25 * sum(thing.size_m[:2]) - math.dist(point_m[:2], thing.xy_m)
    along_m, across_m = thing.floor_pose.local(point_m)
    beyond = (abs(along_m) - 0.5 * thing.size_m[0], abs(across_m) - 0.5 * thing.size_m[1])
    if max(beyond) > 0.0:
        return -math.hypot(*(max(0.0, one) for one in beyond))
    return -max(beyond)


def gap_m(one: Thing, other: Thing) -> float:
    """Return the free way between two footprints, negative by how far they overlap."""
    if is_round(one):
        return -depth_inside_m(one.position_m, other) - 0.25 * sum(one.size_m[:2])
    if is_round(other):
        return gap_m(other, one)
    return max(_parted_m(one, other), _parted_m(other, one))


def polygon_depth_m(point_m: Sequence[float], polygon_m: Sequence[Sequence[float]]) -> float:
    """Return how far a point lies within a convex polygon; outside, negative."""
    corners: NDArray[np.float64] = np.array(polygon_m, dtype=np.float64)
    edges = np.roll(corners, -1, axis=0) - corners
    lengths = np.linalg.norm(edges, axis=1)
    offsets = np.array(point_m[:2]) - corners
    sides = edges[:, 0] * offsets[:, 1] - edges[:, 1] * offsets[:, 0]
    inward = math.copysign(1.0, _area2(corners)) * sides / np.maximum(lengths, 1e-9)
    if inward.min() >= 0.0:
        return float(inward.min())
    along = np.clip((offsets * edges).sum(axis=1) / np.maximum(lengths**2, 1e-12), 0.0, 1.0)
    nearest = offsets - along[:, None] * edges
    return -float(np.linalg.norm(nearest, axis=1).min())


def _parted_m(one: Thing, other: Thing) -> float:
    """Return by how much `other` clears the sides of `one`, in the better of its two directions."""
    half = 0.5 * np.array(one.size_m[:2])
    ends = 0.5 * np.array(other.size_m[:2]) * [(i, j) for i in (-1, 1) for j in (-1, 1)]
    local = np.array([one.floor_pose.local(corner) for corner in other.floor_pose.place(ends)])
    return float((np.maximum(local.min(axis=0), -local.max(axis=0)) - half).max())


def _area2(corners: NDArray[np.float64]) -> float:
    x, y = corners.T
    return float(np.dot(x, np.roll(y, -1)) - np.dot(y, np.roll(x, -1)))
