"""Decide whether an image shows that a remembered thing is no longer where it was."""

import math
from collections.abc import Sequence

import numpy as np

from vla_deploy.perception.geometry.cloud import Cloud
from vla_deploy.perception.geometry.lens import project
from vla_deploy.perception.images.detection import Detection, Vector
from vla_deploy.world.vocabulary import CONTAINERS

# Further away a thing may be overlooked.
CLEAR_RANGE_M = 1.6
BORDER_PX = 12
PATCH_PX = 2
IN_FRONT_M = 0.05
# What is lower than this shows no nearer than what it lies on.
FLAT_M = 0.04
# Over an empty place the camera sees this share of the thing's height further.
THROUGH_RATIO = 0.25


def is_in_clear_view(
    place: Vector, size_m: Vector, cloud: Cloud, found: Sequence[Detection]
) -> bool:
    """Return whether an image shows a thing's place (base frame) with nothing in front of it.

    Where something stands that no detection explains, it may well be the thing: its place is not in
    clear view then. Neither is one out of the image or too far away.
    """
    camera = cloud.camera
    x, y, z = cloud.base_from_camera[:3, :3].T @ (np.array(place) - cloud.camera_position)
    if not 0.2 < z < CLEAR_RANGE_M:
        return False
    half = math.ceil(0.5 * camera.fx * max(size_m) / z)
    border = BORDER_PX + half
    u, v = (round(value) for value in project(camera, np.array([[x, y, z]]))[0])
    if not (border <= u < camera.width - border and border <= v < camera.height - border):
        return False
    around = np.s_[v - half : v + half + 1, u - half : u + half + 1]
    patch = np.s_[v - PATCH_PX : v + PATCH_PX + 1, u - PATCH_PX : u + PATCH_PX + 1]
    if cloud.own_body[around].any() or not cloud.valid[patch].all():
        return False
    depth_m = float(np.median(cloud.depth_m[patch]))
    is_hidden = depth_m < z - 0.5 * max(size_m) - IN_FRONT_M
    return not (is_hidden or _is_unexplained(depth_m - z, place, size_m, found))


def _is_unexplained(
    beyond_m: float, place: Vector, size_m: Vector, found: Sequence[Detection]
) -> bool:
    """Return whether something is where a thing was that no detection explains.

    A box around the place explains nothing: the thing may stand in it.
    """
    height_m = size_m[2]
    if height_m < FLAT_M or beyond_m > THROUGH_RATIO * height_m:
        return False
    return not any(
        math.dist(one.position_m[:2], place[:2]) < 0.5 * (max(one.size_m[:2]) + min(size_m[:2]))
        for one in found
        if one.class_name not in CONTAINERS or max(one.size_m[:2]) < 2.0 * max(size_m[:2])
    )
