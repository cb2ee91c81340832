"""Turn an RGB-D image into points in the base frame, pixel by pixel."""

import math
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from drivers.camera.protocol import Intrinsics
from vla_deploy.perception.geometry.lens import ray_table
from vla_deploy.robots.floor_pose import Pose2D

Floats = NDArray[np.float32]
Mask = NDArray[np.bool_]

MIN_DEPTH_M = 0.2
MAX_DEPTH_M = 3.0
# Stereo depth noise grows with the square of the distance.
DEPTH_SIGMA_PER_M = 0.0012
# Encoders and mounting of a head that stands still.
AIM_SIGMA_RAD = 0.0005
# How well stamps of images and joints agree: a camera that turns meanwhile looks elsewhere.
STAMP_SIGMA_S = 0.01
SMOOTHING_PX = 3
SPARSE_PX = 3
UPRIGHT = 0.9
EDGE_RATIO = 0.15


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PosedImage:
    """Hold an image and the pose of camera and robot when it was taken.

    `base_from_camera` is 4 x 4, from the optical frame (z forward); `base` is the robot's pose in
    the map; `body` marks the pixels that show the robot itself.
    """

    rgb: NDArray[np.uint8]
    depth_m: Floats
    camera: Intrinsics
    base_from_camera: NDArray[np.float64]
    body: Mask
    base: Pose2D
    stamp_ns: int
    aim_sigma_rad: float = AIM_SIGMA_RAD


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Cloud:
    """Hold an image's points; `points` is (h, w, 3) in metres, x forward, z up from the floor.

    `aim_sigma_rad` is how well the camera's direction is known.
    """

    rgb: NDArray[np.uint8]
    depth_m: Floats
    points: Floats
    valid: Mask
    own_body: Mask
    camera: Intrinsics
    base_from_camera: NDArray[np.float64]
    aim_sigma_rad: float

    @property
    def camera_position(self) -> NDArray[np.float64]:
        """Return where the camera is in the base frame."""
        position: NDArray[np.float64] = self.base_from_camera[:3, 3]
        return position

    def sigma_m(self) -> Floats:
        """Return the depth noise to expect at each pixel."""
        sigma: Floats = np.float32(DEPTH_SIGMA_PER_M) * self.depth_m**2
        return sigma


def aim_sigma_rad(turn_rad_s: float) -> float:
    """Return the standard deviation of a camera's direction while it turns at a rate."""
    return math.hypot(AIM_SIGMA_RAD, STAMP_SIGMA_S * turn_rad_s)


def make_cloud(
    rgb: NDArray[np.uint8],
    depth_m: Floats,
    camera: Intrinsics,
    base_from_camera: NDArray[np.float64],
    body: Mask | None = None,
    aim_sigma_rad: float = AIM_SIGMA_RAD,
) -> Cloud:
    """Back-project an image; `base_from_camera` is 4x4 from the optical frame (z forward).

    `body` marks pixels that show the robot itself; `aim_sigma_rad` is how well the direction of the
    camera is known.
    """
    valid = (depth_m > MIN_DEPTH_M) & (depth_m < MAX_DEPTH_M)
    own_body = np.zeros_like(valid) if body is None else body
    return Cloud(
        rgb=rgb,
        depth_m=depth_m,
        points=_back_project(depth_m, camera, base_from_camera),
        valid=valid & ~own_body,
        own_body=own_body,
        camera=camera,
        base_from_camera=base_from_camera,
        aim_sigma_rad=aim_sigma_rad,
    )


def sparse_points(
    depth_m: Floats,
    camera: Intrinsics,
    base_from_camera: NDArray[np.float64],
    body: Mask,
    *,
    within_m: tuple[float, float],
) -> NDArray[np.float64]:
    """Return the points (n, 3), in the base frame, of every third pixel of every third row.

    Those of the robot's own `body`, and those whose depth is out of bounds, are left out.
    """
    some = (slice(None, None, SPARSE_PX), slice(None, None, SPARSE_PX))
    near_m, far_m = within_m
    depth = depth_m[some].astype(np.float64)
    rows, columns = np.nonzero((depth > near_m) & (depth < far_m) & ~body[some])
    z = depth[rows, columns]
    x, y = ray_table(camera)[some][rows, columns].T * z
    rotation, origin = base_from_camera[:3, :3], base_from_camera[:3, 3]
    points: NDArray[np.float64] = np.column_stack((x, y, z)) @ rotation.T + origin
    return points


def _back_project(
    depth_m: Floats, camera: Intrinsics, base_from_camera: NDArray[np.float64]
) -> Floats:
    """Return each pixel's point; only the pose is new from image to image, the rays are not."""
    rays = ray_table(camera)
    across, down = rays[..., 0], rays[..., 1]
    points: Floats = np.empty((*depth_m.shape, 3), np.float32)
    for axis in range(3):
        right, below, ahead, origin = base_from_camera[axis].astype(np.float32)
        ray = right * across
        ray += below * down
        ray += ahead
        ray *= depth_m
        np.add(ray, origin, out=points[..., axis])
    return points


def upward_area(cloud: Cloud, stride: int = 1) -> Floats:
    """Return the area in m^2 of level, upward surface that a pixel shows, else 0.

    With a `stride`, only every so many pixels of every so many rows are looked at.
    """
    smooth = cv2.blur(cloud.points, (SMOOTHING_PX, SMOOTHING_PX))
    at = slice(stride, -1, stride)
    before, behind = slice(stride - 1, -2, stride), slice(stride + 1, None, stride)
    along_u = smooth[at, behind] - smooth[at, before]
    along_v = smooth[behind, at] - smooth[before, at]
    # Rows run towards the robot: v x u looks up from a surface that faces the camera.
    normal_x = along_v[..., 1] * along_u[..., 2] - along_v[..., 2] * along_u[..., 1]
    normal_y = along_v[..., 2] * along_u[..., 0] - along_v[..., 0] * along_u[..., 2]
    normal_z = along_v[..., 0] * along_u[..., 1] - along_v[..., 1] * along_u[..., 0]
    length = np.sqrt(normal_x**2 + normal_y**2 + normal_z**2)
    upright = (normal_z > UPRIGHT * length) & _on_one_surface(cloud)[at, at]
    area = np.zeros_like(cloud.depth_m[::stride, ::stride])
    rows, columns = length.shape
    # The two differences span two pixels each way: a quarter of their parallelogram is the pixel.
    area[1 : rows + 1, 1 : columns + 1] = np.where(upright, length * 0.25, 0.0)
    return area


def _on_one_surface(cloud: Cloud) -> Mask:
    """Return where the smoothing window crosses no edge in depth."""
    kernel = np.ones((SMOOTHING_PX + 2, SMOOTHING_PX + 2), dtype=np.uint8)
    depth = np.where(cloud.valid, cloud.depth_m, 0.0).astype(np.float32)
    nearest = cv2.erode(depth, kernel)
    smooth: Mask = (nearest > 0.0) & (cv2.dilate(depth, kernel) - nearest < EDGE_RATIO * depth)
    return smooth
