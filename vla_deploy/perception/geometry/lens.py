"""Convert pixels into rays and points into pixels, with the lens' distortion.

Intrinsics without distortion coefficients are those of a pinhole. The ray of each pixel is computed
once for a camera, since distortion can only be undone by iteration.
"""

from functools import lru_cache
from typing import Final

import cv2
import numpy as np
from numpy.typing import NDArray

from drivers.camera.protocol import Intrinsics

Floats = NDArray[np.float32]
Array = NDArray[np.float64]

CAMERAS_KEPT: Final = 4
# A lens that moves no pixel further than this needs no undistortion for a detector.
MAX_SHIFT_PX: Final = 1.0
# Beyond the widest ray of the image the distortion polynomial means nothing and may fold back.
WIDEST_RATIO: Final = 1.2
_CRITERIA: Final = (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 40, 1e-9)


@lru_cache(maxsize=CAMERAS_KEPT)
def ray_table(camera: Intrinsics) -> Floats:
    """Return each pixel's ray (h, w, 2): right and down per unit of depth; not to be written."""
    columns, rows = np.meshgrid(np.arange(camera.width), np.arange(camera.height))
    pixels = np.stack((columns, rows), axis=-1).reshape(-1, 2).astype(np.float64)
    table: Floats = (
        rays_of(camera, pixels).reshape(camera.height, camera.width, 2).astype(np.float32)
    )
    table.flags.writeable = False
    return table


def rays_of(camera: Intrinsics, pixels: Array) -> Array:
    """Return the rays (n, 2) of points in the image (n, 2) in pixels."""
    if not camera.distortion:
        plain: Array = (pixels - (camera.cx, camera.cy)) / (camera.fx, camera.fy)
        return plain
    rays: Array = cv2.undistortPoints(
        pixels.reshape(-1, 1, 2), matrix_of(camera), _coefficients(camera), criteria=_CRITERIA
    ).reshape(-1, 2)
    return rays


def project(camera: Intrinsics, points: Array) -> Array:
    """Return where points (n, 3) of the optical frame, all in front, appear in pixels (n, 2)."""
    rays = points[:, :2] / points[:, 2:]
    pinhole: Array = rays * (camera.fx, camera.fy) + (camera.cx, camera.cy)
    if not camera.distortion or not len(points):
        return pinhole
    inside = np.linalg.norm(rays, axis=1) < WIDEST_RATIO * _widest(camera)
    origin = np.zeros(3)
    if np.any(inside):
        bent, _ = cv2.projectPoints(
            points[inside].reshape(-1, 1, 3), origin, origin, matrix_of(camera),
            _coefficients(camera),
        )  # fmt: skip
        pinhole[inside] = bent.reshape(-1, 2)
    return pinhole


def matrix_of(camera: Intrinsics) -> Array:
    """Return the camera matrix, 3 x 3."""
    return np.array([[camera.fx, 0.0, camera.cx], [0.0, camera.fy, camera.cy], [0.0, 0.0, 1.0]])


def needs_undistortion(camera: Intrinsics) -> bool:
    """Return whether the lens moves any pixel by more than `MAX_SHIFT_PX`."""
    return bool(camera.distortion) and _largest_shift_px(camera) > MAX_SHIFT_PX


def undistorted(image: NDArray[np.uint8], camera: Intrinsics) -> NDArray[np.uint8]:
    """Return the image that a pinhole of the same focal length and middle would have taken."""
    columns, rows = _undistortion_maps(camera)
    flat: NDArray[np.uint8] = cv2.remap(image, columns, rows, cv2.INTER_LINEAR)
    return flat


def distorted_boxes(camera: Intrinsics, corners_px: Floats) -> Floats:
    """Return boxes (n, 4) of an undistorted image as they lie in the camera's own image.

    A box there encloses the four bent corners and the middles of the four bent sides.
    """
    if not len(corners_px):
        return corners_px
    left, top, right, bottom = corners_px.T.astype(np.float64)
    across, down = (left + right) / 2, (top + bottom) / 2
    x = np.stack((left, across, right, right, right, across, left, left), axis=1)
    y = np.stack((top, top, top, down, bottom, bottom, bottom, down), axis=1)
    rays = np.stack(((x - camera.cx) / camera.fx, (y - camera.cy) / camera.fy, np.ones_like(x)), -1)
    bent = project(camera, rays.reshape(-1, 3)).reshape(*x.shape, 2)
    corners: Floats = np.hstack((bent.min(axis=1), bent.max(axis=1))).astype(np.float32)
    limits = np.array((camera.width, camera.height) * 2, dtype=np.float32)
    return np.clip(corners, np.float32(0.0), limits)


def _coefficients(camera: Intrinsics) -> Array:
    return np.array(camera.distortion, dtype=np.float64)


@lru_cache(maxsize=CAMERAS_KEPT)
def _widest(camera: Intrinsics) -> float:
    return float(np.linalg.norm(ray_table(camera), axis=-1).max())


@lru_cache(maxsize=CAMERAS_KEPT)
def _largest_shift_px(camera: Intrinsics) -> float:
    columns, rows = _undistortion_maps(camera)
    u, v = np.meshgrid(np.arange(camera.width), np.arange(camera.height))
    return float(np.hypot(columns - u, rows - v).max())


@lru_cache(maxsize=CAMERAS_KEPT)
def _undistortion_maps(camera: Intrinsics) -> tuple[Floats, Floats]:
    """Return the column and row of the camera's image from which each undistorted pixel comes."""
    matrix, size = matrix_of(camera), (camera.width, camera.height)
    columns, rows = cv2.initUndistortRectifyMap(
        matrix, _coefficients(camera), None, matrix, size, cv2.CV_32FC1
    )
    return columns, rows
