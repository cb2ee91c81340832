"""Tell where a board is in the camera's frame, and how well a lens explains what is seen of it."""

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from drivers.camera.protocol import Intrinsics
from vla_deploy.perception.camera_tools.board import Array, BoardView
from vla_deploy.perception.camera_tools.errors import BadImages
from vla_deploy.perception.geometry.lens import matrix_of, project


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
