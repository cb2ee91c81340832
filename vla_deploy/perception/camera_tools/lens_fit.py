"""Fit a lens to views of a board, and refuse what cannot be true."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import cv2
import numpy as np

from drivers.camera.protocol import Intrinsics
from vla_deploy.perception.camera_tools.board import Array, BoardView
from vla_deploy.perception.camera_tools.errors import BadImages, ImplausibleResult
from vla_deploy.perception.camera_tools.selecting import MIN_VIEWS, require_variety
from vla_deploy.robots.camera import LensCalibration
from vla_deploy.runtime.one_line import one_line

MODELS: Final = {"plumb_bob": 5, "rational_polynomial": 8}
"""ROS' names of the distortion models, and their numbers of coefficients."""
MAX_ERROR_PX: Final = 0.7
# A view this many times worse than the usual one is left out once: a finger, a bent corner.
OUTLIER_RATIO: Final = 3.0
# Boards that all face the same way do not separate distance and focal length.
TILTED_RAD: Final = math.radians(12.0)
TILTED_VIEWS: Final = 3
MAX_FOCAL_SIGMA_RATIO: Final = 0.01


@dataclass(frozen=True, kw_only=True)
class LensFit:
    """Hold a fitted lens; errors are root mean squares, `sigma_px` is of fx, fy, cx, cy."""

    intrinsics: Intrinsics
    distortion_model: str
    error_px: float
    view_errors_px: dict[str, float]
    outliers: dict[str, float]
    sigma_px: tuple[float, float, float, float]

    def calibration(self, tool: str, made_at: str) -> LensCalibration:
        """Return the lens for the robot's folder."""
        return LensCalibration(
            intrinsics=self.intrinsics,
            distortion_model=self.distortion_model,
            reprojection_error_px=round(self.error_px, 4),
            views=len(self.view_errors_px),
            made_at=made_at,
            tool=tool,
        )


@dataclass(frozen=True, kw_only=True, eq=False)
class _Solved:
    error_px: float
    matrix: Array
    coefficients: Array
    turns: Array
    sigma: Array
    errors_px: Array


def fit_lens(
    views: Sequence[BoardView], size_px: tuple[int, int], model: str = "plumb_bob"
) -> LensFit:
    """Return the lens that explains the views best.

    Raises:
        BadImages: too few, all alike, all facing the same way, or not all over the image.
        ImplausibleResult: the corners are too far from where the lens puts them, or its focal
            length stays uncertain.
    """
    require_variety(views, size_px)
    solved = _solve(views, size_px, model)
    limit = OUTLIER_RATIO * float(np.median(solved.errors_px))
    outliers = {
        view.name: round(float(error), 3)
        for view, error in zip(views, solved.errors_px, strict=True)
        if error > max(limit, 0.5 * MAX_ERROR_PX)
    }
    kept = [view for view in views if view.name not in outliers]
    if outliers and len(kept) >= MIN_VIEWS:
        solved = _solve(kept, size_px, model)
    else:
        kept, outliers = list(views), {}
    _require_tilt(solved)
    _require_sense(solved)
    return _as_fit(solved, kept, outliers, size_px, model)


def _solve(views: Sequence[BoardView], size_px: tuple[int, int], model: str) -> _Solved:
    # A third power bends the corners of the image wherever no view has held it; ROS leaves it out.
    flags = cv2.CALIB_RATIONAL_MODEL if model == "rational_polynomial" else cv2.CALIB_FIX_K3
    boards = [view.corners_m.astype(np.float32) for view in views]
    pixels = [view.pixels.astype(np.float32) for view in views]
    try:
        error, matrix, coefficients, turns, _, sigma, _, errors = cv2.calibrateCameraExtended(
            boards, pixels, size_px, None, None, flags=flags
        )
    except cv2.error as failure:
        raise ImplausibleResult(
            f"no lens explains these views ({one_line(failure)}); check that the "
            "board lies flat and is described as it is printed"
        ) from failure
    return _Solved(
        error_px=float(error),
        matrix=matrix,
        coefficients=np.ravel(coefficients)[: MODELS[model]],
        turns=np.array(turns).reshape(-1, 3),
        sigma=np.ravel(sigma)[:4],
        errors_px=np.ravel(errors),
    )


def _require_tilt(solved: _Solved) -> None:
    normals = np.array([cv2.Rodrigues(turn)[0][:, 2] for turn in solved.turns])
    usual = normals.mean(axis=0) / np.linalg.norm(normals.mean(axis=0))
    angles = np.arccos(np.clip(normals @ usual, -1.0, 1.0))
    tilted = int(np.count_nonzero(angles > TILTED_RAD))
    if tilted < TILTED_VIEWS:
        raise BadImages(
            f"{tilted} views show the board tilted by more than {math.degrees(TILTED_RAD):.0f} "
            f"degrees against the others, expected {TILTED_VIEWS}; tilt it up, down, left, right"
        )


def _require_sense(solved: _Solved) -> None:
    if not solved.error_px <= MAX_ERROR_PX:
        raise ImplausibleResult(
            f"reprojection error {solved.error_px:.2f} px, expected at most {MAX_ERROR_PX}; is the "
            "board flat, its size right, and nothing moving while images are taken?"
        )
    doubt = float(max(solved.sigma[:2]) / solved.matrix[0, 0])
    if not doubt <= MAX_FOCAL_SIGMA_RATIO:
        raise ImplausibleResult(
            f"the focal length is known to {100 * doubt:.1f} % only, expected "
            f"{100 * MAX_FOCAL_SIGMA_RATIO:.0f} %; take more views, nearer and more tilted"
        )


def _as_fit(
    solved: _Solved,
    views: Sequence[BoardView],
    outliers: dict[str, float],
    size_px: tuple[int, int],
    model: str,
) -> LensFit:
    matrix, sigma = solved.matrix, [float(value) for value in solved.sigma]
    return LensFit(
        intrinsics=Intrinsics(
            width=size_px[0],
            height=size_px[1],
            fx=float(matrix[0, 0]),
            fy=float(matrix[1, 1]),
            cx=float(matrix[0, 2]),
            cy=float(matrix[1, 2]),
            distortion=tuple(float(value) for value in solved.coefficients),
        ),
        distortion_model=model,
        error_px=solved.error_px,
        view_errors_px={
            view.name: round(float(error), 3)
            for view, error in zip(views, solved.errors_px, strict=True)
        },
        outliers=outliers,
        sigma_px=(sigma[0], sigma[1], sigma[2], sigma[3]),
    )
