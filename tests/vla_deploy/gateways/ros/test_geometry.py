"""Depth and beams become points where things are; points become cells."""

import cv2
import numpy as np
import pytest

from drivers.camera.protocol import Intrinsics
from vla_deploy.gateways.ros.geometry import (
    BodyFrames,
    beam_points,
    depth_points,
    mark_seen,
    moved,
    near_segments,
    pixels_of,
    standing,
    thinned,
)
from vla_deploy.robots import load_robot
from vla_deploy.robots.floor_pose import Pose2D
from vla_deploy.robots.kinematics.model import RobotModel

BENT = (0.12, -0.2, 0.001, -0.002, 0.05)


def lens(distortion=()):
    return Intrinsics(
        width=64, height=48, fx=60.0, fy=61.0, cx=31.2, cy=24.5, distortion=distortion
    )


@pytest.mark.parametrize("distortion", [(), BENT, (*BENT, 0.01, 0.0, 0.0)])
def test_each_pixel_gives_the_point_that_shows_there(distortion) -> None:
    camera = lens(distortion)
    points = depth_points(np.full((48, 64), 1.5), camera, stride=4)
    rows, columns = np.mgrid[0:48:4, 0:64:4]
    assert np.allclose(points[:, 2], 1.5)
    expected = np.column_stack((columns.ravel(), rows.ravel()))
    assert np.allclose(pixels_of(points, camera), expected, atol=0.02)
    matrix = np.array([[60.0, 0, 31.2], [0, 61.0, 24.5], [0, 0, 1]])
    by_opencv, _ = cv2.projectPoints(
        points, np.zeros(3), np.zeros(3), matrix, np.array(distortion or (0.0,) * 4)
    )
    assert np.allclose(pixels_of(points, camera), by_opencv.reshape(-1, 2))


def test_pixels_without_a_depth_give_no_point() -> None:
    depths = np.zeros((48, 64))
    depths[8, 12], depths[16, 16] = 2.0, 60.0
    assert len(depth_points(depths, lens(), stride=4)) == 1


def test_beams_lie_counter_clockwise_from_the_front() -> None:
    ranges = np.zeros(360)
    ranges[[0, 90, 180]] = 1.0, 2.0, 30.0
    found = beam_points(ranges, far_m=8.0)
    assert np.allclose(found, [(1, 0, 0), (0, 2, 0)])
    assert np.allclose(moved(found, standing(Pose2D(1.0, 1.0, np.pi / 2))), [(1, 2, 0), (-1, 1, 0)])


def test_a_cloud_is_thinned_evenly() -> None:
    points = np.random.default_rng(3).uniform(-1, 1, (5000, 3))
    kept = thinned(points, most=400, cell_m=0.1)
    assert len(kept) == 400
    assert np.all(kept.min(axis=0) < -0.8)
    assert np.all(kept.max(axis=0) > 0.8)
    assert len(thinned(np.zeros((9, 3)), most=400)) == 1
    assert thinned(np.empty((0, 3)), most=4).shape == (0, 3)


def test_what_is_near_a_line_is_told() -> None:
    begin, end = np.array([[0.0, 0, 0]]), np.array([[1.0, 0, 0]])
    points = np.array([(0.5, 0.05, 0), (0.5, 0.2, 0), (-0.05, 0, 0), (1.3, 0, 0)])
    assert near_segments(points, begin, end, 0.1).tolist() == [True, False, True, False]
    assert near_segments(points, begin, begin, 0.1).tolist() == [False, False, True, False]


def test_hits_are_occupied_and_the_way_to_them_is_free_where_nothing_was_known() -> None:
    cells = np.full((10, 10), -1, dtype=np.int8)
    cells[5, 4] = 100
    mark_seen(cells, 0.1, (0.0, 0.0), (0.15, 0.55), np.array([(0.85, 0.55), (9.0, 0.55)]))
    assert cells[5].tolist() == [-1, 0, 0, 0, 100, 0, 0, 0, 100, 0]
    assert (np.delete(cells, 5, axis=0) == -1).all()


def test_frames_are_where_the_dynamics_have_them() -> None:
    robot = load_robot("butler")
    rng = np.random.default_rng(5)
    positions = np.array([rng.uniform(robot.limits[one].min, robot.limits[one].max)
                          for one in robot.joint_names])  # fmt: skip
    poses = BodyFrames(robot).poses(positions)
    expected = RobotModel(robot).camera_pose(positions)
    assert np.allclose(poses["camera_color_optical_frame"], expected, atol=1e-6)
