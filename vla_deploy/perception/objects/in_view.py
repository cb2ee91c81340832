"""Tell whether an image shows that a remembered thing is no longer where it was."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum

import numpy as np
from numpy.typing import NDArray

from drivers.camera.protocol import Intrinsics
from vla_deploy.perception.geometry.cloud import Cloud
from vla_deploy.perception.geometry.lens import project
from vla_deploy.perception.images.detection import Detection, Vector
from vla_deploy.world.vocabulary import CONTAINERS

# A missing thing is missed only where its kind would surely be found.
CLEAR_RANGE_M = 1.6
BORDER_PX = 12
PATCH_PX = 2
IN_FRONT_M = 0.05
# What is lower than this shows no nearer than what it lies on.
FLAT_M = 0.04
# An empty place lets one see so much of the thing's height further.
THROUGH_RATIO = 0.25


class PlaceView(Enum):
    """Say what the image shows at the place of a remembered thing."""

    CLEAR = "its place is in clear view"
    HIDDEN = "out of the image, too far, something in front, or something there that has no name"


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Image:
    """Hold an image's cloud, and by which camera from where it was taken."""

    cloud: Cloud
    camera: Intrinsics
    base_from_camera: NDArray[np.float64]


def view_of(place: Vector, size_m: Vector, image: Image, found: Sequence[Detection]) -> PlaceView:
    """Return whether the image shows a thing's place (base frame) with nothing in front of it.

    What stands there and was found as nothing may well be the thing: that does not show its place
    without it.
    """
    point = np.array(place)
    rotation, camera_position = image.base_from_camera[:3, :3], image.base_from_camera[:3, 3]
    x, y, z = rotation.T @ (point - camera_position)
    if not 0.2 < z < CLEAR_RANGE_M:
        return PlaceView.HIDDEN
    camera, cloud = image.camera, image.cloud
    half = math.ceil(0.5 * camera.fx * max(size_m) / z)
    border = BORDER_PX + half
    u, v = (round(value) for value in project(camera, np.array([[x, y, z]]))[0])
    if not (border <= u < camera.width - border and border <= v < camera.height - border):
        return PlaceView.HIDDEN
    around = np.s_[v - half : v + half + 1, u - half : u + half + 1]
    patch = np.s_[v - PATCH_PX : v + PATCH_PX + 1, u - PATCH_PX : u + PATCH_PX + 1]
    if cloud.own_body[around].any() or not cloud.valid[patch].all():
        return PlaceView.HIDDEN
    depth_m = float(np.median(cloud.depth_m[patch]))
    if depth_m < z - 0.5 * max(size_m) - IN_FRONT_M:
        return PlaceView.HIDDEN
    return PlaceView.HIDDEN if _stands(depth_m - z, place, size_m, found) else PlaceView.CLEAR


def _stands(beyond_m: float, place: Vector, size_m: Vector, found: Sequence[Detection]) -> bool:
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
