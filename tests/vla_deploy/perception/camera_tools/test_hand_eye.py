"""A camera's wrong seat is found from views of a board while the head turns."""

import math
from dataclasses import replace
from typing import TYPE_CHECKING

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from vla_deploy.perception.camera_tools.board import BoardView, CalibrationBoard
from vla_deploy.perception.camera_tools.board_pose import board_pose, depth_ratio
from vla_deploy.perception.camera_tools.errors import BadImages, ImplausibleResult
from vla_deploy.perception.camera_tools.hand_eye import HeadView, fit_hand_eye
from vla_deploy.perception.geometry.lens import project
from vla_deploy.robots import load_robot
from vla_deploy.robots.kinematics.model import RobotModel, full_positions

if TYPE_CHECKING:
    from conftest import BoardCamera

Array = NDArray[np.float64]
ROBOT = load_robot("butler")
MODEL = RobotModel(ROBOT)
BOARD = CalibrationBoard(square_m=0.055)
PANS, TILTS = (-0.22, 0.0, 0.22), (0.44, 0.6, 0.76)


def site(pan: float, tilt: float) -> Array:
    return MODEL.site_pose(
        ROBOT.camera.site, full_positions(ROBOT, [("head_pan", pan), ("head_tilt", tilt)])
    )


def seat() -> Array:
    """Return where the camera really sits on its site: millimetres and degrees off."""
    pose = np.eye(4)
    pose[:3, :3] = cv2.Rodrigues(np.radians([1.5, -2.0, 1.0]))[0]
    pose[:3, 3] = (0.006, -0.004, 0.008)
    return pose


def base_from_board() -> Array:
    at = np.eye(4)
    at[:3, :3] = cv2.Rodrigues(np.array([0.15, 0.1, 0.05]))[0]
    middle = np.array((BOARD.columns, BOARD.rows, 0.0)) * 0.5 * BOARD.square_m
    at[:3, 3] = np.array((0.0, 0.0, 0.6)) - at[:3, :3] @ middle
    pose: Array = site(0.0, 0.6) @ seat() @ at
    return pose


def exact_views(camera: "BoardCamera", noise_px: float = 0.2) -> list[HeadView]:
    random = np.random.default_rng(0)
    views = []
    for pan in PANS:
        for tilt in TILTS:
            pose = np.linalg.inv(site(pan, tilt) @ seat()) @ base_from_board()
            points = BOARD.corners_m @ pose[:3, :3].T + pose[:3, 3]
            pixels = project(camera.lens, points) + random.normal(0.0, noise_px, (len(points), 2))
            view = BoardView(name=f"{pan} {tilt}", pixels=pixels, corners_m=BOARD.corners_m)
            views.append(HeadView(view=view, base_from_site=site(pan, tilt)))
    return views


def test_the_seat_is_found_to_two_millimetres_and_a_fifth_of_a_degree(
    board_camera: "BoardCamera",
) -> None:
    found = fit_hand_eye(exact_views(board_camera), board_camera.lens)
    shift = found.site_from_camera[:3, 3] - seat()[:3, 3]
    turn = cv2.Rodrigues(seat()[:3, :3].T @ found.site_from_camera[:3, :3])[0]
    assert np.linalg.norm(shift) < 0.002
    assert np.linalg.norm(turn) < math.radians(0.2)
    assert np.linalg.norm(shift) < 3.0 * found.shift_sigma_m
    assert found.residual_m < 0.001
    x, y, z, w = found.quaternion_xyzw()
    expected = 2.0 * math.acos(w)
    assert expected == pytest.approx(np.linalg.norm(cv2.Rodrigues(seat()[:3, :3])[0]), abs=0.004)
    assert math.hypot(x, y, z, w) == pytest.approx(1.0)


def test_some_wrong_corners_do_not_draw_it_away(board_camera: "BoardCamera") -> None:
    views = exact_views(board_camera)
    for one in views[::2]:
        one.view.pixels[3] += (9.0, -7.0)
    found = fit_hand_eye(views, board_camera.lens)
    assert np.linalg.norm(found.site_from_camera[:3, 3] - seat()[:3, 3]) < 0.002


def test_a_head_that_turns_about_one_axis_only_is_refused(board_camera: "BoardCamera") -> None:
    views = exact_views(board_camera)
    panned = [one for one in views if one.view.name.endswith(" 0.6")] * 3
    with pytest.raises(BadImages, match="pan and tilt"):
        fit_hand_eye(panned, board_camera.lens)


def test_too_few_views_are_refused(board_camera: "BoardCamera") -> None:
    with pytest.raises(BadImages, match="5 usable views"):
        fit_hand_eye(exact_views(board_camera)[:5], board_camera.lens)


def test_joints_that_do_not_belong_to_the_images_are_refused(board_camera: "BoardCamera") -> None:
    views = exact_views(board_camera)
    mixed = [
        replace(one, base_from_site=other.base_from_site)
        for one, other in zip(views, reversed(views), strict=True)
    ]
    with pytest.raises(ImplausibleResult, match="contradict"):
        fit_hand_eye(mixed, board_camera.lens)


def test_a_wrong_depth_scale_is_seen_at_the_board(board_camera: "BoardCamera") -> None:
    one = exact_views(board_camera)[4]
    pose = board_pose(one.view, board_camera.lens)
    assert pose.error_px < 0.4
    plane_m = pose.camera_from_board[2, 3]
    depth_m = np.full((240, 320), 1.05 * plane_m, np.float32)
    ratio = depth_ratio(one.view, pose, depth_m)
    assert ratio == pytest.approx(1.05, abs=0.03)
    assert depth_ratio(one.view, pose, np.zeros((240, 320), np.float32)) is None
