"""Depth that is missing, saturated or wrong here and there, and a head that turns meanwhile.

Places keep, or their stated error grows with the real one, or nothing is placed at all.
"""

import math
from typing import TYPE_CHECKING

import numpy as np
import pytest
from numpy.typing import NDArray

from vla_deploy.perception.geometry.cloud import aim_sigma_rad, make_cloud
from vla_deploy.perception.geometry.supports import find_supports
from vla_deploy.perception.images.detection import Detection, detect
from vla_deploy.perception.objects.body_state import JointHistory
from vla_deploy.robots.floor_pose import Pose2D

if TYPE_CHECKING:
    from conftest import StillFlat

pytestmark = pytest.mark.gl

Depth = NDArray[np.float32]
CHI2_99 = 9.21
SATURATED_M = 65.535
THINGS = ("red_cup", "blue_ball", "book")
GAP_NS = 100_000_000


def stand(flat: "StillFlat", **joints: float) -> None:
    flat.scatter(2)
    flat.stand_at_viewpoint("coffee_table", **{"head_tilt": 0.75, **joints})


def look(
    flat: "StillFlat",
    depth_m: Depth,
    rgb: NDArray[np.uint8],
    joints: NDArray[np.float64] | None = None,
) -> dict[str, Detection]:
    """Return what is seen nearest to each thing; arms are tucked out of view."""
    pose = flat.kinematics.camera_pose(flat.joints if joints is None else joints)
    cloud = make_cloud(rgb, depth_m, flat.grid.camera, pose)
    found = detect(cloud, find_supports(cloud))
    seen = {}
    for name in THINGS:
        near = [one for one in found if off(flat, name, one) < 0.12]
        if near:
            seen[name] = min(near, key=lambda one: off(flat, name, one))
    return seen


def offset(flat: "StillFlat", name: str, seen: Detection) -> NDArray[np.float64]:
    truth = flat.truth(name)
    local = Pose2D(float(truth[0]), float(truth[1]), 0.0).relative_to(flat.base)
    return np.array(seen.position_m[:2]) - (local.x_m, local.y_m)


def off(flat: "StillFlat", name: str, seen: Detection) -> float:
    return float(np.linalg.norm(offset(flat, name, seen)))


def sigma_m(seen: Detection) -> float:
    return math.sqrt(seen.covariance_m2[0][0] + seen.covariance_m2[1][1])


def is_honest(flat: "StillFlat", name: str, seen: Detection) -> bool:
    stated = np.array(seen.covariance_m2)[:2, :2]
    error = offset(flat, name, seen)
    return bool(error @ np.linalg.solve(stated, error) < CHI2_99)


@pytest.mark.parametrize("level_m", [0.0, SATURATED_M])
def test_a_hole_in_a_thing_makes_its_place_less_sure(flat: "StillFlat", level_m: float) -> None:
    stand(flat)
    rgb, depth_m = flat.noisy_view(np.random.default_rng(0))
    whole = look(flat, depth_m, rgb)
    holed = depth_m.copy()
    for name in THINGS:
        left, top, right, bottom = whole[name].box_px
        wide, high = right - left, bottom - top
        holed[top + high // 4 : bottom - high // 4, left + wide // 4 : right - wide // 4] = level_m
    seen = look(flat, holed, rgb)
    assert seen
    for name, one in seen.items():
        assert sigma_m(one) > 2.0 * sigma_m(whole[name]), name
        assert is_honest(flat, name, one), name


def test_the_more_depth_is_missing_at_random_the_less_sure_a_place_is(flat: "StillFlat") -> None:
    stand(flat)
    rgb, depth_m = flat.noisy_view(np.random.default_rng(0))
    sigmas = []
    for share in (0.0, 0.02, 0.05, 0.3):
        lost = np.random.default_rng(1).random(depth_m.shape) < share
        seen = look(flat, np.where(lost, np.float32(0.0), depth_m), rgb)
        assert all(is_honest(flat, name, one) for name, one in seen.items())
        sigmas.append(sigma_m(seen["book"]) if "book" in seen else math.inf)
    assert sigmas == sorted(sigmas)
    assert sigmas[2] < 0.02


@pytest.mark.parametrize("reach_m", [-0.4, 0.7, 60.0])
def test_single_wrong_pixels_do_not_move_things(flat: "StillFlat", reach_m: float) -> None:
    stand(flat)
    rgb, depth_m = flat.noisy_view(np.random.default_rng(0))
    wrong = np.random.default_rng(3).random(depth_m.shape) < 0.005
    spiked = np.where(wrong, np.maximum(depth_m + np.float32(reach_m), np.float32(0.001)), depth_m)
    seen = look(flat, spiked.astype(np.float32), rgb)
    assert set(seen) == set(THINGS)
    for name, one in seen.items():
        assert off(flat, name, one) < 0.012, name
        assert is_honest(flat, name, one), name


@pytest.mark.parametrize("level_m", [0.0, SATURATED_M, 0.05])
def test_an_image_without_depth_shows_nothing(flat: "StillFlat", level_m: float) -> None:
    stand(flat)
    rgb, depth_m = flat.noisy_view(np.random.default_rng(0))
    assert look(flat, np.full_like(depth_m, level_m), rgb) == {}


def test_a_turning_head_does_not_smear_things(flat: "StillFlat") -> None:
    rate_rad_s, exposed_s, now_s = 0.3, 0.213, 0.28
    history = JointHistory()
    for step in range(15):
        stand(flat, head_pan=rate_rad_s * 0.02 * step)
        history.add(step * 20_000_000, flat.joints.copy())
    stand(flat, head_pan=rate_rad_s * exposed_s)
    rgb, depth_m = flat.noisy_view(np.random.default_rng(0))
    then = history.at(round(exposed_s * 1e9), GAP_NS)
    newest = history.at(round(now_s * 1e9), GAP_NS)
    assert then is not None
    assert newest is not None
    sharp, smeared = look(flat, depth_m, rgb, then), look(flat, depth_m, rgb, newest)
    still = look(flat, depth_m, rgb)
    for name in THINGS:
        assert off(flat, name, sharp[name]) < off(flat, name, still[name]) + 0.001
        moved = offset(flat, name, smeared[name]) - offset(flat, name, still[name])
        assert float(np.linalg.norm(moved)) > 0.008


def test_the_stated_error_grows_with_how_fast_the_camera_turns(flat: "StillFlat") -> None:
    stand(flat)
    rgb, depth_m = flat.noisy_view(np.random.default_rng(0))
    pose = flat.kinematics.camera_pose(flat.joints)
    stated = []
    for turn_rad_s in (0.0, 0.3, 1.0):
        cloud = make_cloud(
            rgb, depth_m, flat.grid.camera, pose, aim_sigma_rad=aim_sigma_rad(turn_rad_s)
        )
        nearest, *_ = detect(cloud, find_supports(cloud))
        stated.append(sigma_m(nearest))
    assert stated[0] < stated[1] < stated[2]
