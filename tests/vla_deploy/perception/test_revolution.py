"""Turned bodies fitted to points that a camera would see of them; no image is needed."""

import math
from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray

from vla_deploy.perception.geometry.clusters import Cluster
from vla_deploy.perception.geometry.revolution import fit_lying, fit_upright
from vla_deploy.perception.geometry.supports import Support

CAMERA = np.array([0.0, 0.0, 1.2])
TABLE_M = 0.5
PIXEL_M, SIGMA_M = 0.004, 0.001
TABLE = Support(
    plane=(0.0, 0.0, TABLE_M), outline=np.array([[0, -1], [2, -1], [2, 1], [0, 1]], np.float32)
)
Points = NDArray[np.float64]
Surface = Callable[[Points, Points], tuple[Points, Points]]


def cluster_of(points: Points) -> Cluster:
    return Cluster(
        support=TABLE,
        points=points.astype(np.float32),
        heights=(points[:, 2] - TABLE_M).astype(np.float32),
        rgb=np.zeros((len(points), 3), np.uint8),
        pixels=np.arange(len(points)),
        depth_m=float(np.linalg.norm(points.mean(axis=0) - CAMERA)),
        box_px=(10, 10, 50, 50),
        truncated=False,
        occluded=False,
    )


def seen(surface: Points, normals: Points, sigma_m: float = SIGMA_M) -> Points:
    """Return the points that face the camera, with noise along their rays."""
    rays = surface - CAMERA
    lit = np.einsum("ij,ij->i", rays, normals) < 0.0
    rays = rays[lit] / np.linalg.norm(rays[lit], axis=1, keepdims=True)
    noise = np.random.default_rng(0).normal(0.0, sigma_m, (len(rays), 1))
    points: Points = surface[lit] + noise * rays
    return points


def tube(radius_m: float, length_m: float) -> tuple[Points, Points]:
    """Return points and normals of a tube along z, its middle at the origin."""
    angle = np.arange(0.0, 2 * math.pi, 0.5 * PIXEL_M / radius_m)
    z = np.arange(-0.5 * length_m, 0.5 * length_m, PIXEL_M)
    angle, z = (grid.ravel() for grid in np.meshgrid(angle, z))
    normals = np.column_stack((np.cos(angle), np.sin(angle), np.zeros_like(angle)))
    points = normals * radius_m
    points[:, 2] = z
    return points, normals


def lain_down(yaw_rad: float) -> Points:
    """Return the turn that lays z along a yaw."""
    c, s = math.cos(yaw_rad), math.sin(yaw_rad)
    return np.array([[0.0, -s, c], [0.0, c, s], [-1.0, 0.0, 0.0]])


def upright_can(x: float, y: float, radius_m: float = 0.033, height_m: float = 0.11) -> Points:
    points, normals = tube(radius_m, height_m)
    return seen(points + np.array((x, y, TABLE_M + 0.5 * height_m)), normals)


@pytest.mark.parametrize(("x", "y"), [(0.5, 0.0), (0.7, 0.3), (0.9, -0.25)])
def test_an_upright_can_is_placed_at_its_axis_though_its_far_side_is_hidden(
    x: float, y: float
) -> None:
    points = upright_can(x, y)
    fit = fit_upright(cluster_of(points), CAMERA, PIXEL_M, SIGMA_M)
    assert fit is not None
    assert math.dist(fit.xy, (x, y)) < 0.0025
    assert fit.radius_m == pytest.approx(0.033, abs=0.0025)
    assert math.dist(points[:, :2].mean(axis=0), (x, y)) > 0.012


def test_a_handle_beside_it_does_not_move_the_axis() -> None:
    handle = np.random.default_rng(1).uniform(
        (0.59, 0.035, TABLE_M + 0.03), (0.61, 0.055, TABLE_M + 0.06), (60, 3)
    )
    points = np.vstack((upright_can(0.6, 0.0), handle))
    fit = fit_upright(cluster_of(points), CAMERA, PIXEL_M, SIGMA_M)
    assert fit is not None
    assert math.dist(fit.xy, (0.6, 0.0)) < 0.0025


@pytest.mark.parametrize("yaw_rad", [-1.2, -0.3, 0.0, 0.8, 1.5])
def test_a_bottle_on_its_side_tells_its_axis(yaw_rad: float) -> None:
    body, normals = tube(0.033, 0.16)
    turn = lain_down(yaw_rad)
    points = seen(body @ turn.T + (0.6, 0.1, TABLE_M + 0.033), normals @ turn.T)
    first_idea = yaw_rad + 0.2
    fit = fit_lying(cluster_of(points), first_idea, PIXEL_M, SIGMA_M)
    assert fit is not None
    assert abs(math.remainder(fit.yaw_rad - yaw_rad, math.pi)) < math.radians(1.0)
    assert math.dist(fit.xy, (0.6, 0.1)) < 0.003
    assert fit.radius_m == pytest.approx(0.033, abs=0.0015)
    assert fit.agreement > 0.9


def test_the_stated_error_of_the_axis_grows_with_the_noise() -> None:
    body, normals = tube(0.033, 0.16)
    turn = lain_down(0.4)
    placed = body @ turn.T + (0.6, 0.1, TABLE_M + 0.033)
    stated = []
    for sigma_m in (0.0005, 0.004):
        points = seen(placed, normals @ turn.T, sigma_m)
        fit = fit_lying(cluster_of(points), 0.4, PIXEL_M, sigma_m)
        assert fit is not None
        stated.append((fit.sigma_xy_m[1], fit.yaw_sigma_rad))
    assert stated[1] > (4.0 * stated[0][0], 4.0 * stated[0][1])


def test_a_flat_thing_is_no_cylinder() -> None:
    grid = np.mgrid[0.5:0.64:0.004, -0.03:0.03:0.004].reshape(2, -1).T
    top = np.column_stack((grid, np.full(len(grid), TABLE_M + 0.04)))
    fit = fit_lying(cluster_of(top), 0.0, PIXEL_M, SIGMA_M)
    assert fit is None or fit.agreement < 0.6


def test_too_few_points_are_no_body() -> None:
    few = upright_can(0.6, 0.0)[:6]
    assert fit_upright(cluster_of(few), CAMERA, PIXEL_M, SIGMA_M) is None
    assert fit_lying(cluster_of(few), 0.0, PIXEL_M, SIGMA_M) is None
