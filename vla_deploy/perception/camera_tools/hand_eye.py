"""Estimate the camera's mounting on the head from views of a fixed board while the head turns.

Unknown are the camera's pose on its site and the board's in the base frame; both are fitted to all
corners of all views (least squares on pixels, with Huber's weights against wrong corners).
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import cv2
import numpy as np

from drivers.camera.protocol import Intrinsics
from vla_deploy.perception.camera_tools.board import Array, BoardView
from vla_deploy.perception.camera_tools.board_pose import board_pose, placed, rms
from vla_deploy.perception.camera_tools.errors import BadImages, ImplausibleResult
from vla_deploy.perception.geometry.lens import project
from vla_deploy.robots.camera import CameraDescription, CameraMounting
from vla_deploy.robots.kinematics.orientation import angle_rad, quaternion_of

MIN_VIEWS: Final = 6
# Turns about one axis alone leave the place along it open.
MIN_TURN_RAD: Final = math.radians(4.0)
MAX_ERROR_PX: Final = 1.5
MAX_SHIFT_SIGMA_M: Final = 0.004
MAX_TURN_SIGMA_RAD: Final = math.radians(0.4)
HUBER_PX: Final = 1.0
ROUNDS: Final = 40
# Corners of one image share errors of the head's joints: so many count as one.
ALIKE: Final = 2.0
_STEP: Final = 1e-6
_ENOUGH: Final = 1e-9


@dataclass(frozen=True, kw_only=True, eq=False)
class HeadView:
    """Hold a view of the board and where the camera's site was then, in the base frame (4 x 4)."""

    view: BoardView
    base_from_site: Array


@dataclass(frozen=True, kw_only=True, eq=False)
class HandEye:
    """Hold the camera in its site's frame (4 x 4); `residual_m` is the spread of the board's place.

    The sigmas are those of the shift and the turn of the camera.
    """

    site_from_camera: Array
    error_px: float
    view_errors_px: dict[str, float]
    residual_m: float
    shift_sigma_m: float
    turn_sigma_rad: float

    def quaternion_xyzw(self) -> tuple[float, float, float, float]:
        """Return the camera's turn against its site; w is above 0, as the turn is small."""
        x, y, z, w = (float(value) for value in quaternion_of(self.site_from_camera[:3, :3]))
        return (x, y, z, w)

    def turn_rad(self) -> float:
        """Return the angle between the camera and its site."""
        return angle_rad(self.site_from_camera[:3, :3])

    def mounting(self, camera: CameraDescription, made_at: str) -> CameraMounting:
        """Return the mounting for the robot's folder."""
        x, y, z = (round(float(value), 6) for value in self.site_from_camera[:3, 3])
        return CameraMounting(
            site=camera.site,
            model=camera.model,
            focal_px=camera.intrinsics.fx,
            translation_m=(x, y, z),
            quaternion_xyzw=self.quaternion_xyzw(),
            residual_m=round(self.residual_m, 6),
            made_at=made_at,
        )


def fit_hand_eye(views: Sequence[HeadView], camera: Intrinsics) -> HandEye:
    """Fit the camera's pose on its site.

    Raises:
        BadImages: too few views, or the head turned too little or about one axis only.
        ImplausibleResult: the views contradict each other, or the pose stays uncertain.
    """
    _require_turns(views)
    state = np.zeros(12)
    first = board_pose(views[0].view, camera).camera_from_board
    state[6:] = _as_vector(views[0].base_from_site @ first)
    state, jacobian, offsets = _solved(state, views, camera)
    error_px = _usual_px(offsets)
    if not error_px <= MAX_ERROR_PX:
        raise ImplausibleResult(
            f"the views contradict each other by {error_px:.2f} px, expected at most "
            f"{MAX_ERROR_PX}; did base or board move, or the head while images were taken?"
        )
    normal = jacobian.T @ jacobian + 1e-12 * np.eye(12)
    covariance = np.linalg.inv(normal) * ALIKE * (error_px**2 / 2.0 + 1e-4)
    sigma = np.sqrt(np.diag(covariance))
    turn_sigma_rad, shift_sigma_m = float(max(sigma[:3])), float(max(sigma[3:6]))
    if shift_sigma_m > MAX_SHIFT_SIGMA_M or turn_sigma_rad > MAX_TURN_SIGMA_RAD:
        raise ImplausibleResult(
            f"the camera's place is known to {1000 * shift_sigma_m:.1f} mm and "
            f"{math.degrees(turn_sigma_rad):.2f} degrees only; take more views, pan and tilt "
            "further, bring the board nearer"
        )
    pose = _as_pose(state[:6])
    return HandEye(
        site_from_camera=pose,
        error_px=error_px,
        view_errors_px=_by_view(offsets, views),
        residual_m=_spread_m(pose, views, camera),
        shift_sigma_m=shift_sigma_m,
        turn_sigma_rad=turn_sigma_rad,
    )


def _require_turns(views: Sequence[HeadView]) -> None:
    if len(views) < MIN_VIEWS:
        raise BadImages(f"{len(views)} usable views, expected {MIN_VIEWS} or more")
    first = views[0].base_from_site[:3, :3]
    turns = np.array(
        [cv2.Rodrigues(first.T @ one.base_from_site[:3, :3])[0].ravel() for one in views]
    )
    spread = np.linalg.svd(turns - turns.mean(axis=0), compute_uv=False) / math.sqrt(len(views))
    if spread[1] < MIN_TURN_RAD:
        raise BadImages(
            f"the head turned by {math.degrees(spread[0]):.1f} degrees about one axis and by "
            f"{math.degrees(spread[1]):.1f} about the other (root mean square), expected "
            f"{math.degrees(MIN_TURN_RAD):.0f} about both: pan and tilt it"
        )


def _solved(
    state: Array, views: Sequence[HeadView], camera: Intrinsics
) -> tuple[Array, Array, Array]:
    """Return the state that fits best (Levenberg-Marquardt), with slope and offsets there."""
    damping = 1e-3
    offsets = _offsets(state, views, camera)
    for _ in range(ROUNDS):
        jacobian, weights = _slope(state, offsets, views, camera), _huber(offsets)
        normal = jacobian.T @ (weights[:, None] * jacobian)
        pull = jacobian.T @ (weights * offsets)
        step = -np.linalg.solve(normal + damping * np.diag(np.diag(normal) + 1e-12), pull)
        fresh = _offsets(state + step, views, camera)
        if _cost(fresh) >= _cost(offsets):
            damping *= 10.0
            if damping > 1e9:
                break
            continue
        state, offsets, damping = state + step, fresh, damping / 10.0
        if float(np.abs(step).max()) < _ENOUGH:
            break
    return state, _slope(state, offsets, views, camera), offsets


def _offsets(state: Array, views: Sequence[HeadView], camera: Intrinsics) -> Array:
    """Return by how many pixels each corner is off, one row after the other."""
    camera_from_site = np.linalg.inv(_as_pose(state[:6]))
    base_from_board = _as_pose(state[6:])
    parts = []
    for one in views:
        pose = camera_from_site @ np.linalg.inv(one.base_from_site) @ base_from_board
        points = placed(pose, one.view.corners_m)
        points[:, 2] = np.maximum(points[:, 2], 1e-3)
        parts.append((project(camera, points) - one.view.pixels).ravel())
    return np.concatenate(parts)


def _slope(state: Array, at: Array, views: Sequence[HeadView], camera: Intrinsics) -> Array:
    columns = [
        (_offsets(state + _STEP * unit, views, camera) - at) / _STEP for unit in np.eye(len(state))
    ]
    return np.column_stack(columns)


def _lengths(offsets: Array) -> Array:
    return np.repeat(np.linalg.norm(offsets.reshape(-1, 2), axis=1), 2)


def _huber(offsets: Array) -> Array:
    weights: Array = np.minimum(1.0, HUBER_PX / np.maximum(_lengths(offsets), 1e-9))
    return weights


def _cost(offsets: Array) -> float:
    length = _lengths(offsets)[::2]
    far = length > HUBER_PX
    return float(np.sum(np.where(far, HUBER_PX * (2.0 * length - HUBER_PX), length**2)))


def _usual_px(offsets: Array) -> float:
    """Return the root mean square offset, in which far ones count as little as in the fit."""
    weights = _huber(offsets)[::2]
    return float(np.sqrt(np.average(_lengths(offsets)[::2] ** 2, weights=weights**2)))


def _by_view(offsets: Array, views: Sequence[HeadView]) -> dict[str, float]:
    ends = np.cumsum([2 * len(one.view.pixels) for one in views])[:-1]
    parts = np.split(offsets, ends)
    return {
        one.view.name: round(rms(part.reshape(-1, 2)), 3)
        for one, part in zip(views, parts, strict=True)
    }


def _spread_m(pose: Array, views: Sequence[HeadView], camera: Intrinsics) -> float:
    """Return how far apart the views put the board's middle: root mean square."""
    middle = np.array(views[0].view.corners_m).mean(axis=0)
    at = np.array(
        [
            placed(
                one.base_from_site @ pose @ board_pose(one.view, camera).camera_from_board,
                middle[None],
            )[0]
            for one in views
        ]
    )
    return float(np.sqrt(np.mean(np.sum((at - at.mean(axis=0)) ** 2, axis=1))))


def _as_pose(vector: Array) -> Array:
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = cv2.Rodrigues(vector[:3])[0], vector[3:]
    return pose


def _as_vector(pose: Array) -> Array:
    return np.concatenate((cv2.Rodrigues(pose[:3, :3])[0].ravel(), pose[:3, 3]))
