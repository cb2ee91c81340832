"""Find level surfaces in a cloud of points."""

import numpy as np
import pytest

from drivers.camera.protocol import Intrinsics
from vla_deploy.perception.geometry.cloud import Cloud, make_cloud
from vla_deploy.perception.geometry.supports import KnownSurface, Support, find_supports

FOCAL_PX = 500.0
ABOVE_M = 1.0
SMALL_PX, LARGE_PX = 80, 140
"""Squares of 0.16 and 0.28 m: below and above what makes a surface of its own."""
AROUND = np.array([[0.7, -0.3], [1.3, -0.3], [1.3, 0.3], [0.7, 0.3]], np.float32)


def seen_from_above(height_m: float, size_px: int) -> Cloud:
    """Return a level square, one metre before the robot, as a camera above it sees it."""
    camera = Intrinsics(
        width=size_px, height=size_px, fx=FOCAL_PX, fy=FOCAL_PX, cx=size_px / 2, cy=size_px / 2
    )
    pose = np.array(
        [[0.0, -1.0, 0.0, 1.0], [-1.0, 0.0, 0.0, 0.0], [0.0, 0.0, -1.0, 0.0], [0.0, 0.0, 0.0, 1.0]]
    )
    pose[2, 3] = height_m + ABOVE_M
    depth_m = np.full((size_px, size_px), ABOVE_M, np.float32)
    return make_cloud(np.zeros((size_px, size_px, 3), np.uint8), depth_m, camera, pose)


def found(height_m: float, size_px: int, known_m: tuple[float, ...] = ()) -> list[Support]:
    known = [KnownSurface(height_m=one, outline=AROUND) for one in known_m]
    return find_supports(seen_from_above(height_m, size_px), known)


@pytest.mark.parametrize("height_m", [0.0, 0.4, 0.7655, 0.7999])
def test_a_large_level_square_is_a_surface_at_its_height(height_m: float) -> None:
    (support,) = found(height_m, LARGE_PX)
    assert support.height_m(1.0, 0.0) == pytest.approx(height_m, abs=0.002)


def test_a_small_one_is_a_surface_only_where_one_is_known() -> None:
    assert found(0.7655, SMALL_PX) == []
    (support,) = found(0.7655, SMALL_PX, (0.77,))
    assert support.height_m(1.0, 0.0) == pytest.approx(0.7655, abs=0.002)


@pytest.mark.parametrize("known_m", [0.7985, 0.7325])
def test_a_small_one_is_no_piece_of_a_surface_at_another_height(known_m: float) -> None:
    assert found(0.7655, SMALL_PX, (known_m,)) == []
