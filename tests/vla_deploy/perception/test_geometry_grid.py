"""What geometry measures costs the same whatever the camera's size, and lies at the same place."""

import numpy as np
import pytest

from drivers.camera.base import RgbdFrame
from drivers.camera.protocol import Intrinsics
from vla_deploy.perception.detectors.boxes import Boxes
from vla_deploy.perception.geometry.cloud import make_cloud
from vla_deploy.perception.geometry.geometry_grid import GRID_PIXELS, geometry_grid
from vla_deploy.perception.geometry.lens import ray_table
from vla_deploy.perception.images.network_view import NetworkView

BARREL = (-0.3, 0.1, 0.0, 0.0, 0.0)
SIZES = [(321, 240), (512, 384), (640, 480), (848, 480), (1280, 720), (1920, 1200)]


def camera(width: int, height: int, distortion: tuple[float, ...] = ()) -> Intrinsics:
    focal_px = 0.5 * width
    return Intrinsics(
        width=width, height=height, fx=focal_px, fy=focal_px,
        cx=0.49 * width, cy=0.51 * height, distortion=distortion,
    )  # fmt: skip


def slanted_floor(source: Intrinsics) -> np.ndarray:
    """Return the depth in metres of a plane below a level camera, where it is in view."""
    down = ray_table(source)[..., 1]
    return np.where(down > 0.1, 1.0 / np.maximum(down, 0.1), 0.0).astype(np.float32)


@pytest.mark.parametrize("size", [(320, 240), (160, 120), (1, 1)])
def test_a_small_image_stays_as_it_is(size: tuple[int, int]) -> None:
    source = camera(*size)
    grid = geometry_grid(source)
    depth = np.zeros(size[::-1], np.uint16)
    assert grid.camera == source
    assert grid.depth(depth) is depth


@pytest.mark.parametrize("size", SIZES)
def test_a_large_image_has_no_more_points_and_shows_all_of_its_view(size: tuple[int, int]) -> None:
    source = camera(*size)
    grid = geometry_grid(source).camera
    assert grid.width * grid.height == pytest.approx(GRID_PIXELS, rel=0.01)
    whole, reduced = ray_table(source), ray_table(grid)
    pixel = 1.0 / grid.fx
    for corner in ((0, 0), (0, -1), (-1, 0), (-1, -1)):
        assert reduced[corner] == pytest.approx(whole[corner], abs=0.6 * pixel)


@pytest.mark.parametrize("distortion", [(), BARREL])
@pytest.mark.parametrize("size", SIZES)
def test_points_lie_where_those_of_the_whole_image_lie(
    size: tuple[int, int], distortion: tuple[float, ...]
) -> None:
    grid = geometry_grid(camera(*size, distortion))
    depth_m = grid.depth(slanted_floor(grid.source))
    cloud = make_cloud(np.zeros((*depth_m.shape, 3), np.uint8), depth_m, grid.camera, np.eye(4))
    near = cloud.valid & (depth_m > 0.0) & (depth_m < 2.0)
    assert np.count_nonzero(near) > 0.02 * GRID_PIXELS
    assert np.all(np.abs(cloud.points[near][:, 1] - 1.0) < 0.001)


def test_depth_is_never_a_mean_of_two_surfaces() -> None:
    grid = geometry_grid(camera(512, 384))
    depth = np.where(np.arange(512) % 3 == 0, 700, 1400).astype(np.uint16) * np.ones(
        (384, 1), np.uint16
    )
    assert set(np.unique(grid.depth(depth))) == {700, 1400}


def test_depth_beside_a_hole_is_that_of_a_pixel() -> None:
    grid = geometry_grid(camera(640, 480))
    depth = np.full((480, 640), 900, np.uint16)
    depth[:, 321:] = 0
    assert set(np.unique(grid.depth(depth))) == {0, 900}


def test_noise_becomes_less_and_not_more() -> None:
    grid = geometry_grid(camera(640, 480))
    noise = np.random.default_rng(0).normal(1.0, 0.001, (480, 640)).astype(np.float32)
    assert float(grid.depth(noise).std()) == pytest.approx(0.0005, rel=0.05)


def test_a_frame_keeps_its_stamp_and_a_colour_keeps_its_place() -> None:
    source = camera(640, 480)
    rgb, depth = np.zeros((480, 640, 3), np.uint8), np.full((480, 640), 900, np.uint16)
    rgb[:, 320:] = (200, 10, 10)
    frame = RgbdFrame(
        stamp_ns=7, sequence=3, intrinsics=source, depth_unit_m=0.001, rgb=rgb, depth=depth
    )
    seen = geometry_grid(source).frame(frame)
    assert (seen.stamp_ns, seen.sequence) == (7, 3)
    assert seen.rgb.shape == (240, 320, 3)
    assert seen.depth.shape == (240, 320)
    assert (seen.rgb[:, :160] == 0).all()
    assert (seen.rgb[:, 160:] == (200, 10, 10)).all()


def test_a_networks_boxes_move_along() -> None:
    grid = geometry_grid(camera(512, 384))
    view = NetworkView(
        boxes=Boxes(
            corners_px=np.array([[16, 32, 48, 96]], np.float32),
            scores=np.ones(1, np.float32),
            classes=np.zeros(1, np.intp),
        ),
        reliabilities=(),
    )
    moved = grid.view(view)
    assert moved is not None
    assert moved.boxes.corners_px == pytest.approx(np.array([[10, 20, 30, 60]]))
    assert grid.view(None) is None
