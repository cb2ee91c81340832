"""Rays, projections and flattened images of a lens that bends."""

from dataclasses import replace

import cv2
import numpy as np
import pytest

from drivers.camera.protocol import Intrinsics
from vla_deploy.perception.geometry.body_mask import BodyMask
from vla_deploy.perception.geometry.cloud import make_cloud
from vla_deploy.perception.geometry.lens import (
    distorted_boxes,
    matrix_of,
    needs_undistortion,
    project,
    ray_table,
    undistorted,
)
from vla_deploy.robots import load_robot
from vla_deploy.robots.kinematics.model import RobotModel

PINHOLE = Intrinsics(width=320, height=240, fx=216.5, fy=215.0, cx=161.0, cy=118.0)
LENSES = {
    "pinhole": PINHOLE,
    "plumb_bob": replace(PINHOLE, distortion=(-0.31, 0.11, 0.0009, -0.0013, -0.02)),
    "rational": replace(PINHOLE, distortion=(0.9, 0.2, 1e-4, 1e-4, 0.01, 1.25, 0.35, 0.03)),
}
BARREL = LENSES["plumb_bob"]


@pytest.mark.parametrize("lens", LENSES)
def test_a_pixels_ray_is_projected_back_onto_the_pixel(lens: str) -> None:
    camera = LENSES[lens]
    rays = ray_table(camera)[::17, ::19].reshape(-1, 2).astype(np.float64)
    depth = np.linspace(0.3, 3.0, len(rays))[:, None]
    columns, rows = np.meshgrid(np.arange(0, 320, 19), np.arange(0, 240, 17))
    back = project(camera, np.hstack((rays * depth, depth)))
    assert back == pytest.approx(np.column_stack((columns.ravel(), rows.ravel())), abs=0.01)


def test_points_far_beside_a_bending_image_stay_beside_it() -> None:
    # The polynomial of this lens folds back: by itself it would put them into the image.
    camera = replace(PINHOLE, fx=300.0, fy=300.0, distortion=(-0.25, 0.0, 0.0, 0.0, 0.0))
    beside = np.array([[1.9, 0.0, 1.0], [-1.4, 1.4, 1.0], [0.0, 1.05, 0.5]])
    folded, _ = cv2.projectPoints(
        beside, np.zeros(3), np.zeros(3), matrix_of(camera), np.array(camera.distortion)
    )
    assert np.all((folded > 0) & (folded < (320, 240)))
    told = project(camera, beside)
    assert not np.any(np.all((told > 0) & (told < (320, 240)), axis=1))


def test_a_wall_seen_through_a_bending_lens_is_flat_and_where_it_is() -> None:
    depth_m = np.full((240, 320), 1.5, np.float32)
    cloud = make_cloud(np.zeros((240, 320, 3), np.uint8), depth_m, BARREL, np.eye(4))
    assert cloud.points[..., 2] == pytest.approx(1.5)
    at = np.array([[0.55, -0.4, 1.5]])
    column, row = np.rint(project(BARREL, at)[0]).astype(int)
    assert cloud.points[row, column] == pytest.approx(at[0], abs=0.006)
    taken_for_pinhole = make_cloud(cloud.rgb, depth_m, PINHOLE, np.eye(4))
    assert np.linalg.norm(taken_for_pinhole.points[row, column] - at[0]) > 0.03


def test_the_table_of_rays_is_computed_once_for_a_camera() -> None:
    assert ray_table(BARREL) is ray_table(replace(BARREL))
    with pytest.raises(ValueError, match="read-only"):
        ray_table(BARREL)[0, 0] = 0.0


def test_a_box_of_the_flattened_image_comes_back_to_where_the_thing_is() -> None:
    assert needs_undistortion(BARREL)
    assert not needs_undistortion(PINHOLE)
    assert not needs_undistortion(replace(PINHOLE, distortion=(1e-4,) * 5))
    image = np.zeros((240, 320, 3), np.uint8)
    image[20:60, 250:300] = 255
    flat = undistorted(image, BARREL)
    rows, columns = np.nonzero(flat[..., 0] > 127)
    box = np.array([[columns.min(), rows.min(), columns.max(), rows.max()]], np.float32)
    assert np.abs(box - (250, 20, 299, 59)).max() > 5.0
    # A straight box around a bent square is a little wider than the square.
    assert distorted_boxes(BARREL, box)[0] == pytest.approx((250, 20, 299, 59), abs=6.0)
    assert distorted_boxes(BARREL, box[:0]).shape == (0, 4)


def test_the_robots_own_hands_are_masked_where_the_lens_shows_them() -> None:
    robot = load_robot("butler")
    positions = np.array(
        [0.5 * (robot.limits[n].min + robot.limits[n].max) for n in robot.joint_names]
    )
    index = robot.joint_index
    positions[index["head_tilt"]] = 1.0
    body = BodyMask(RobotModel(robot))
    plain, bent = (body.mask(positions, camera) for camera in (PINHOLE, BARREL))
    assert np.count_nonzero(plain) > 500
    # Barrel distortion draws everything towards the middle: more of the body is in the image.
    assert np.count_nonzero(bent ^ plain) > 100
