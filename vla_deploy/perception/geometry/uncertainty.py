"""Estimate the error of a place: noise, pixel size, hidden parts, and the camera's direction.

The constants were set so that of the errors on the twin's random scenes the right share lies within
the 95 % ellipse (`benchmarks/perception_geometry.py` measures it); real cameras have more faults
than the twin's, which `FLOOR_M` and `AIM_SIGMA_RAD` allow for.
"""

import math

import cv2
import numpy as np
from numpy.typing import NDArray

from vla_deploy.perception.geometry.cloud import DEPTH_SIGMA_PER_M, Cloud
from vla_deploy.perception.geometry.clusters import Cluster
from vla_deploy.perception.geometry.rotation import yaw_rotation

Array = NDArray[np.float64]
Vector = tuple[float, float, float]
Matrix = tuple[Vector, Vector, Vector]

# Of an unknown direction: evenly spread over half a turn.
UNKNOWN_YAW_SIGMA_RAD = math.pi / math.sqrt(12.0)

FLOOR_M = 0.0008
# Error of a thing's middle, as a share of its size, where border or something nearer hides a part.
TRUNCATED_RATIO = 0.3
OCCLUDED_RATIO = 0.15
HOLE_RATIO = 0.5
# Noise of neighbouring pixels is not independent: so many pixels count as one.
PIXELS_PER_SAMPLE = 9.0


def grain_m(cluster: Cluster, cloud: Cloud) -> float:
    """Return the size of a pixel at a cluster's distance."""
    return cluster.depth_m / cloud.camera.fx


def noise_m(cluster: Cluster) -> float:
    """Return the error that depth noise leaves in a mean over a cluster."""
    sigma_m = DEPTH_SIGMA_PER_M * cluster.depth_m**2
    return sigma_m / math.sqrt(max(1.0, len(cluster.points) / PIXELS_PER_SAMPLE))


def hidden_m(cluster: Cluster, cloud: Cloud, size_m: float) -> float:
    """Return by how much the middle may be off because not all of a thing is seen."""
    ratio = HOLE_RATIO * hole_share(cluster, cloud)
    if cluster.truncated:
        ratio += TRUNCATED_RATIO
    elif cluster.occluded:
        ratio += OCCLUDED_RATIO
    return ratio * size_m


def hole_share(cluster: Cluster, cloud: Cloud) -> float:
    """Return the share of a cluster's outline in the image in which depth is missing."""
    rows, columns = np.unravel_index(cluster.pixels, cloud.depth_m.shape)
    left, top, right, bottom = cluster.box_px
    corners = np.column_stack((columns - left, rows - top)).astype(np.int32)
    outline = np.zeros((bottom - top, right - left), dtype=np.uint8)
    cv2.fillConvexPoly(outline, cv2.convexHull(corners), 1)
    missing = ~(cloud.valid | cloud.own_body)[top:bottom, left:right]
    inside = outline > 0
    return float(np.count_nonzero(missing & inside) / np.count_nonzero(inside))


def covariance(
    direction_rad: float, sigma_m: tuple[float, float], height_sigma_m: float, further_m: float
) -> Matrix:
    """Return a position's covariance: sigmas along and across a direction on the floor plan.

    `further_m` is added to each, as errors do that have nothing to do with one another.
    """
    c, s = math.cos(direction_rad), math.sin(direction_rad)
    along, across = (sigma**2 + further_m**2 + FLOOR_M**2 for sigma in sigma_m)
    xy = (along - across) * c * s
    return (
        (along * c * c + across * s * s, xy, 0.0),
        (xy, along * s * s + across * c * c, 0.0),
        (0.0, 0.0, height_sigma_m**2 + FLOOR_M**2),
    )


def turned(matrix: Matrix, yaw_rad: float) -> Matrix:
    """Return a covariance in a frame in which the old one is turned by `yaw_rad`."""
    turn = yaw_rotation(yaw_rad)
    rows = (turn @ np.array(matrix) @ turn.T).tolist()
    return (tuple(rows[0]), tuple(rows[1]), tuple(rows[2]))
