"""Find the pose of a board in the camera's frame, and check lens and depth against it."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Final

import cv2
import numpy as np
from numpy.typing import NDArray

from drivers.camera.protocol import Intrinsics
from vla_deploy.perception.camera_tools.board import Array, BoardView
from vla_deploy.perception.camera_tools.errors import BadImages
from vla_deploy.perception.geometry.lens import matrix_of, project

MAX_CHECK_ERROR_PX: Final = 0.8
MAX_DEPTH_ERROR_RATIO: Final = 0.02


@dataclass(frozen=True, kw_only=True, eq=False)
class BoardPose:
    """Hold the board's frame in the camera's (4 x 4), and the rms of what is left in pixels."""

    camera_from_board: Array
    error_px: float


def board_pose(view: BoardView, camera: Intrinsics) -> BoardPose:
    """Return where the board is.

    Raises:
        BadImages: the corners fit no place of a flat board in front of the camera.
    """
    found, turn, at = cv2.solvePnP(
        view.corners_m,
        view.pixels.reshape(-1, 1, 2),
        matrix_of(camera),
        np.array(camera.distortion or (0.0,) * 4),
        flags=cv2.SOLVEPNP_ITERATIVE,
    )
    pose = np.eye(4)
    if found:
        pose[:3, :3], pose[:3, 3] = cv2.Rodrigues(turn)[0], np.ravel(at)
    if not found or not np.all(np.isfinite(pose)) or pose[2, 3] <= 0.0:
        raise BadImages(
            f"{view.name}: the corners fit no board in front of the camera; leave it out"
        )
    off = project(camera, placed(pose, view.corners_m)) - view.pixels
    return BoardPose(camera_from_board=pose, error_px=rms(off))


def placed(pose: Array, points: Array) -> Array:
    """Return points (n, 3) moved by a pose (4 x 4)."""
    moved: Array = points @ pose[:3, :3].T + pose[:3, 3]
    return moved


def rms(offsets: Array) -> float:
    """Return the root mean square length of offsets (n, 2)."""
    return float(np.sqrt(np.mean(np.sum(offsets**2, axis=1))))


def depth_ratio(view: BoardView, pose: BoardPose, depth_m: NDArray[np.float32]) -> float | None:
    """Return measured over expected depth at the corners; None where too few have depth."""
    columns, rows = np.rint(view.pixels).astype(np.intp).T
    height, width = depth_m.shape
    inside = (columns >= 0) & (columns < width) & (rows >= 0) & (rows < height)
    told = depth_m[rows[inside], columns[inside]]
    expected = placed(pose.camera_from_board, view.corners_m)[inside, 2]
    there = told > 0.0
    if np.count_nonzero(there) < len(view.pixels) // 2:
        return None
    return float(np.median(told[there] / expected[there]))


@dataclass(frozen=True, slots=True, kw_only=True)
class CameraCheck:
    """Hold the errors of views by name, and measured over expected depth where it is known."""

    view_errors_px: dict[str, float]
    depth_ratio: float | None

    @property
    def lens_ok(self) -> bool:
        """Return whether the lens explains every view."""
        return max(self.view_errors_px.values()) <= MAX_CHECK_ERROR_PX

    @property
    def depth_ok(self) -> bool:
        """Return whether depth fits the lens, as far as it is known."""
        return self.depth_ratio is None or abs(self.depth_ratio - 1.0) <= MAX_DEPTH_ERROR_RATIO


def check_camera(
    views: Iterable[BoardView], depths_m: Mapping[str, NDArray[np.float32]], camera: Intrinsics
) -> CameraCheck:
    """Compare views of a board, and the depth images of some, with what the lens expects.

    Raises:
        BadImages: a view fits no pose of the board.
    """
    errors_px, ratios = {}, []
    for view in views:
        pose = board_pose(view, camera)
        errors_px[view.name] = round(pose.error_px, 3)
        if view.name in depths_m:
            ratio = depth_ratio(view, pose, depths_m[view.name])
            ratios += [] if ratio is None else [ratio]
    median = float(np.median(ratios)) if ratios else None
    return CameraCheck(view_errors_px=errors_px, depth_ratio=median)
