"""Estimate a thing's middle, size and yaw by the form that its class has, and their errors.

The errors are those of noise, pixel size, hidden parts, and the camera's direction. Their constants
were set so that of the errors on the twin's random scenes the right share lies within the 95 %
ellipse (`benchmarks/perception_geometry.py` measures it); real cameras have more faults than the
twin's, which `FLOOR_M` and `AIM_SIGMA_RAD` allow for.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from vla_deploy.perception.geometry.cloud import DEPTH_SIGMA_PER_M, Cloud
from vla_deploy.perception.geometry.clusters import Cluster
from vla_deploy.perception.geometry.revolution import (
    RevolutionFit,
    fit_lying,
    fit_upright,
    sight_frame,
)
from vla_deploy.perception.geometry.shapes import MeasuredShape, Rectangle, half_turn, rectangle_of
from vla_deploy.robots.kinematics.orientation import yaw_rotation

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
# As wide as high: a cylinder on its side. The cylinder must explain this share of the points.
LYING_HEIGHT_RATIO = (0.7, 1.4)
LYING_AGREEMENT = 0.6
ROUND_AGREEMENT = 0.3
# Share of a pixel that is left in the middle of, and in the distance between, two edges.
MIDDLE_PX = 0.3
EXTENT_PX = 0.6
# What fills its rectangle badly has no clear middle and direction, since thin parts are not seen.
FULL_RATIO, RAGGED_RATIO, RAGGED_RAD, SKIRT_RATIO = 0.96, 0.3, 1.0, 0.8
# A disc fills pi / 4 of its square, and has no direction.
DISC_SQUARENESS, DISC_FILL_RATIO = 0.85, 0.87
# Thinner than the slice that the class rules look at: that shows more of the near side.
RIM_M, RIM_SIGMAS, RIM_POINTS = 0.005, 3.0, 12
# A direction is off by these shares of a pixel over the length: by edges, and by a fitted axis.
TURN_PX = 0.7
AXIS_PX = 0.25


@dataclass(frozen=True, slots=True, kw_only=True)
class Placement:
    """Hold where a thing is, in the frame of its cloud.

    `size_m` is length along yaw, width, height. `yaw_sigma_rad` is that of the direction of the
    sides: of two like sides, either may count as the length.
    """

    position_m: Vector
    size_m: Vector
    yaw_rad: float
    covariance_m2: Matrix
    size_sigma_m: Vector
    yaw_sigma_rad: float


@dataclass(frozen=True, slots=True, kw_only=True)
class _Spot:
    """Hold a form on the floor plan; the sigmas are along and across `direction_rad`.

    `height_m` is None where the highest points give it best.
    """

    xy: tuple[float, float]
    length_m: float
    width_m: float
    sigma_m: tuple[float, float]
    direction_rad: float
    yaw_rad: float = 0.0
    yaw_sigma_rad: float = UNKNOWN_YAW_SIGMA_RAD
    height_m: float | None = None


@dataclass(frozen=True, slots=True)
class _Target:
    """Hold what a form is fitted to."""

    cluster: Cluster
    shape: MeasuredShape
    cloud: Cloud

    @property
    def grain_m(self) -> float:
        """Return the size of a pixel at the distance of the thing."""
        return self.cluster.depth_m / self.cloud.camera.fx

    @property
    def depth_sigma_m(self) -> float:
        return DEPTH_SIGMA_PER_M * self.cluster.depth_m**2

    @property
    def direction_rad(self) -> float:
        _, sight, _ = sight_frame(self.cluster, self.cloud.camera_position)
        return math.atan2(sight[1], sight[0])


def place(cluster: Cluster, shape: MeasuredShape, class_name: str, cloud: Cloud) -> Placement:
    """Return where a thing of a class is; the class is "object" where it is not known."""
    target = _Target(cluster, shape, cloud)
    spot = _lying(target) if class_name not in NEVER_LIE else None
    spot = spot or FORMS.get(class_name, _block)(target)
    height_m = shape.height_m if spot.height_m is None else spot.height_m
    ground_m = cluster.support.height_m(*spot.xy)
    grain = target.grain_m
    hidden = _hidden_m(cluster, cloud, max(spot.length_m, spot.width_m))
    aim_m = cloud.aim_sigma_rad * cluster.depth_m
    further_m = math.hypot(hidden, _noise_m(target), aim_m)
    extent_m = math.hypot(EXTENT_PX * grain, 2.0 * hidden)
    return Placement(
        position_m=(*spot.xy, ground_m + 0.5 * height_m),
        size_m=(spot.length_m, spot.width_m, height_m),
        yaw_rad=spot.yaw_rad,
        covariance_m2=_covariance(
            spot.direction_rad, spot.sigma_m, _height_sigma_m(target), further_m
        ),
        size_sigma_m=(extent_m, extent_m, 2.0 * _height_sigma_m(target)),
        yaw_sigma_rad=min(
            UNKNOWN_YAW_SIGMA_RAD,
            math.hypot(spot.yaw_sigma_rad, hidden / max(spot.length_m, grain)),
        ),
    )


def _height_sigma_m(target: _Target) -> float:
    """Return the error of the middle's height: half of that of the top."""
    hidden = 0.5 * target.shape.height_m if target.cluster.truncated else 0.0
    return math.hypot(target.depth_sigma_m, hidden)


def _lying(target: _Target) -> _Spot | None:
    """Return a cylinder on its side, None where the points are not on one."""
    base = target.shape.footprint
    low, high = LYING_HEIGHT_RATIO
    if not low < target.shape.height_m / max(base.width_m, 1e-6) < high:
        return None
    best: RevolutionFit | None = None
    for turn in (0.0, math.pi / 2):
        fit = fit_lying(target.cluster, base.yaw_rad + turn, target.grain_m, target.depth_sigma_m)
        if fit is not None and (best is None or fit.agreement > best.agreement):
            best = fit
        if best is not None and best.agreement >= LYING_AGREEMENT:
            break
    if best is None or best.agreement < LYING_AGREEMENT or best.length_m < 2.0 * best.radius_m:
        return None
    return _spot(target, best, best.yaw_rad)


def _upright(target: _Target) -> _Spot:
    camera_position = target.cloud.camera_position
    fit = fit_upright(target.cluster, camera_position, target.grain_m, target.depth_sigma_m)
    if fit is None or fit.agreement < ROUND_AGREEMENT:
        return _round_top(target)
    return _spot(target, fit, target.direction_rad, width_m=target.shape.across_m)


def _spot(
    target: _Target, fit: RevolutionFit, direction_rad: float, width_m: float | None = None
) -> _Spot:
    return _Spot(
        xy=fit.xy,
        length_m=fit.length_m if width_m is None else width_m,
        width_m=2.0 * fit.radius_m if width_m is None else width_m,
        yaw_rad=fit.yaw_rad,
        sigma_m=fit.sigma_xy_m,
        direction_rad=direction_rad,
        yaw_sigma_rad=math.hypot(fit.yaw_sigma_rad, AXIS_PX * target.grain_m / fit.length_m),
    )


def _round_top(target: _Target) -> _Spot:
    """Take the middle of the top: it is seen whole, while the far side is hidden."""
    return _round(target, target.shape.top, target.shape.across_m)


def _rim(target: _Target) -> _Spot:
    """Take the rim alone: below it a handle sticks out, and only the near side is seen."""
    heights = target.cluster.heights
    thick_m = max(RIM_M, RIM_SIGMAS * DEPTH_SIGMA_PER_M * target.cluster.depth_m**2)
    rim = target.cluster.points[heights > target.shape.height_m - thick_m]
    top = rectangle_of(rim[:, :2]) if len(rim) >= RIM_POINTS else target.shape.top
    return _round(target, top, 0.5 * (top.length_m + top.width_m) + 0.5 * target.grain_m)


def _round(target: _Target, top: Rectangle, width_m: float) -> _Spot:
    middle_m = MIDDLE_PX * target.grain_m
    return _Spot(
        xy=top.centre,
        length_m=width_m,
        width_m=width_m,
        sigma_m=(2.0 * middle_m, middle_m),
        direction_rad=target.direction_rad,
    )


def _ball(target: _Target) -> _Spot:
    sphere = target.shape.sphere
    if sphere is None:
        return _block(target)
    sigma_m = MIDDLE_PX * target.grain_m
    return _Spot(
        xy=sphere.centre[:2],
        length_m=2.0 * sphere.radius_m,
        width_m=2.0 * sphere.radius_m,
        sigma_m=(sigma_m, sigma_m),
        direction_rad=target.direction_rad,
        height_m=2.0 * sphere.radius_m,
    )


def _box(target: _Target) -> _Spot:
    return _rectangle(target, target.shape.top)


def _block(target: _Target) -> _Spot:
    base = target.shape.footprint
    if base.width_m > DISC_SQUARENESS * base.length_m and base.fill_ratio < DISC_FILL_RATIO:
        return _round(target, base, 0.5 * (base.length_m + base.width_m))
    return _rectangle(target, base)


def _rectangle(target: _Target, base: Rectangle) -> _Spot:
    ragged = max(0.0, FULL_RATIO - base.fill_ratio)
    whole = target.shape.whole
    # Low parts, such as the blades of keys, are not gripped, but belong to the thing.
    skirt_m = math.dist(base.centre, whole.centre)
    skirt_rad = abs(half_turn(whole.yaw_rad - base.yaw_rad)) if skirt_m > target.grain_m else 0.0
    middle_m = MIDDLE_PX * target.grain_m + RAGGED_RATIO * ragged * base.length_m
    middle_m += SKIRT_RATIO * skirt_m
    return _Spot(
        xy=base.centre,
        length_m=base.length_m,
        width_m=base.width_m,
        yaw_rad=base.yaw_rad,
        sigma_m=(middle_m, middle_m),
        direction_rad=base.yaw_rad,
        yaw_sigma_rad=TURN_PX * target.grain_m / max(base.length_m, 1e-6)
        + RAGGED_RAD * ragged
        + SKIRT_RATIO * skirt_rad,
    )


NEVER_LIE = frozenset({"ball", "box", "bowl", "phone", "keys", "remote", "block"})
FORMS: dict[str, Callable[[_Target], _Spot]] = {
    "bottle": _upright,
    "can": _upright,
    "cup": _rim,
    "bowl": _rim,
    "ball": _ball,
    "box": _box,
}


def _noise_m(target: _Target) -> float:
    """Return the error that depth noise leaves in a mean over a cluster."""
    samples = max(1.0, len(target.cluster.points) / PIXELS_PER_SAMPLE)
    return target.depth_sigma_m / math.sqrt(samples)


def _hidden_m(cluster: Cluster, cloud: Cloud, size_m: float) -> float:
    """Return by how much the middle may be off because not all of a thing is seen."""
    ratio = HOLE_RATIO * _hole_share(cluster, cloud)
    if cluster.truncated:
        ratio += TRUNCATED_RATIO
    elif cluster.occluded:
        ratio += OCCLUDED_RATIO
    return ratio * size_m


def _hole_share(cluster: Cluster, cloud: Cloud) -> float:
    """Return the share of a cluster's outline in the image in which depth is missing."""
    rows, columns = np.unravel_index(cluster.pixels, cloud.depth_m.shape)
    left, top, right, bottom = cluster.box_px
    corners = np.column_stack((columns - left, rows - top)).astype(np.int32)
    outline = np.zeros((bottom - top, right - left), dtype=np.uint8)
    cv2.fillConvexPoly(outline, cv2.convexHull(corners), 1)
    missing = ~(cloud.valid | cloud.own_body)[top:bottom, left:right]
    inside = outline > 0
    return float(np.count_nonzero(missing & inside) / np.count_nonzero(inside))


def _covariance(
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
