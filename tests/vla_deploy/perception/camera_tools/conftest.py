"""A camera with a known lens that looks at a printed board: images are computed pixel by pixel."""

from collections.abc import Callable

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from drivers.camera.protocol import Intrinsics
from vla_deploy.perception.camera_tools.board import CalibrationBoard
from vla_deploy.perception.geometry.lens import rays_of

Array = NDArray[np.float64]
BOARD = CalibrationBoard()
LENS = Intrinsics(
    width=320,
    height=240,
    fx=221.0,
    fy=222.5,
    cx=157.0,
    cy=122.5,
    distortion=(-0.24, 0.07, 0.0011, -0.0008, 0.0),
)
PER_PIXEL = 2
_BLOCKS = 8
Taker = Callable[..., NDArray[np.uint8]]


def pose(
    turn: tuple[float, float, float],
    at: tuple[float, float, float],
    board: CalibrationBoard = BOARD,
) -> Array:
    """Return the board's frame in the camera's; `at` is where its middle is."""
    matrix = np.eye(4)
    matrix[:3, :3] = cv2.Rodrigues(np.array(turn, dtype=np.float64))[0]
    middle = np.array((board.columns, board.rows, 0.0)) * 0.5 * board.square_m
    matrix[:3, 3] = np.array(at) - matrix[:3, :3] @ middle
    return matrix


class BoardCamera:
    """Take images of the board through one lens; each pixel is the mean of several rays."""

    def __init__(self, lens: Intrinsics, board: CalibrationBoard = BOARD) -> None:
        self.lens = lens
        self._board = board
        self._print = cv2.resize(board.image(), None, fx=0.5, fy=0.5, interpolation=cv2.INTER_AREA)
        fine = (np.arange(lens.width * PER_PIXEL) + 0.5) / PER_PIXEL - 0.5
        down = (np.arange(lens.height * PER_PIXEL) + 0.5) / PER_PIXEL - 0.5
        columns, rows = np.meshgrid(fine, down)
        pixels = np.column_stack((columns.ravel(), rows.ravel()))
        parts = np.array_split(pixels, _BLOCKS)
        self._rays = np.vstack([rays_of(lens, part) for part in parts])

    def take(
        self, camera_from_board: Array, blur_px: float = 0.0, noise: float = 2.0, seed: int = 0
    ) -> NDArray[np.uint8]:
        """Return the grey image of the board before a plain wall."""
        board_from_camera = np.linalg.inv(camera_from_board)
        directions = np.column_stack((self._rays, np.ones(len(self._rays))))
        directions = directions @ board_from_camera[:3, :3].T
        depth = -board_from_camera[2, 3] / directions[:, 2]
        at = directions[:, :2] * depth[:, None] + board_from_camera[:2, 3]
        at = 0.5 * (at * self._board.pixels_per_m + self._board.margin_px) - 0.5
        shape = (self.lens.height * PER_PIXEL, self.lens.width * PER_PIXEL)
        x, y = (value.reshape(shape).astype(np.float32) for value in at.T)
        fine = cv2.remap(
            self._print, x, y, cv2.INTER_AREA, borderMode=cv2.BORDER_CONSTANT, borderValue=120
        )
        image = cv2.resize(
            fine, None, fx=1 / PER_PIXEL, fy=1 / PER_PIXEL, interpolation=cv2.INTER_AREA
        )
        if blur_px:
            image = cv2.GaussianBlur(image, (0, 0), blur_px)
        grain = np.random.default_rng(seed).normal(0.0, noise, image.shape)
        taken: NDArray[np.uint8] = np.clip(30 + 0.8 * image + grain, 0, 255).astype(np.uint8)
        return taken


def good_poses() -> list[Array]:
    """Return poses near and far, tilted both ways, in every part of the image."""
    poses = [pose((0.0, 0.0, 0.1), (0.0, 0.0, 0.30))]
    for number, (x, y) in enumerate((u, v) for u in (-0.13, 0.0, 0.13) for v in (-0.09, 0.0, 0.09)):
        tilt = 0.35 + 0.02 * number
        turn = (tilt * (-1) ** number, tilt * (-1) ** (number // 2), 0.2 * (number % 3))
        poses.append(pose(turn, (x, y, 0.34 + 0.012 * number)))
    poses += [
        pose((0.5, 0.0, 0.0), (-0.06, 0.05, 0.32)),
        pose((-0.5, 0.1, 0.0), (0.06, -0.05, 0.32)),
        pose((0.0, 0.55, 1.6), (0.0, 0.0, 0.36)),
        pose((0.1, -0.55, -1.5), (0.02, 0.0, 0.36)),
    ]
    return poses


@pytest.fixture(scope="session")
def board() -> CalibrationBoard:
    return BOARD


@pytest.fixture(scope="session")
def board_camera() -> BoardCamera:
    return BoardCamera(LENS)


@pytest.fixture(scope="session")
def images(board_camera: BoardCamera) -> dict[str, NDArray[np.uint8]]:
    """Return good images of the board by name."""
    return {
        f"view{number:02d}.png": board_camera.take(one, seed=number)
        for number, one in enumerate(good_poses())
    }
