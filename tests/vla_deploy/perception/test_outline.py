"""What ends all around is a thing; what goes on in a sofa, a bed or a table is none."""

import math
from typing import TYPE_CHECKING

import numpy as np
import pytest

from drivers.camera.protocol import Intrinsics
from vla_deploy.perception.geometry.cloud import make_cloud
from vla_deploy.perception.geometry.outline import judge_outline
from vla_deploy.perception.geometry.supports import find_supports
from vla_deploy.perception.images.detection import detect
from vla_deploy.robots.floor_pose import Pose2D

if TYPE_CHECKING:
    from conftest import StillFlat

CAMERA = Intrinsics(width=70, height=60, fx=60.0, fy=60.0, cx=34.5, cy=29.5)
BLOCK, BELOW, ABOVE = np.s_[20:40, 25:45], np.s_[40:, :], np.s_[:20, 25:45]
# How far what is behind a block, 1 m away, and what is above it; is the block a part of that?
AROUND = {
    "far behind": (2.0, 2.0, False),
    "close behind": (1.06, 1.06, False),
    "goes on to all sides": (1.0, 1.0, True),
    "goes on above": (2.0, 1.0, True),
}


@pytest.mark.parametrize("case", AROUND)
def test_a_block_is_a_part_where_its_surface_goes_on(case: str) -> None:
    behind_m, above_m, is_part = AROUND[case]
    depth_m = np.full((CAMERA.height, CAMERA.width), behind_m, np.float32)
    depth_m[ABOVE], depth_m[BLOCK], depth_m[BELOW] = above_m, 1.0, 1.0
    heights = np.full(depth_m.shape, 0.1, np.float32)
    heights[BELOW] = 0.0
    cloud = make_cloud(np.zeros((*depth_m.shape, 3), np.uint8), depth_m, CAMERA, np.eye(4))
    pixels = np.arange(depth_m.size).reshape(depth_m.shape)[BLOCK].ravel()
    assert judge_outline(cloud, heights, pixels).is_part is is_part


# From where, on a tour, a sofa's back, a bed's pillows and a table's legs were taken for things.
VIEWS = (
    Pose2D(2.6, 4.61, 3.093),
    Pose2D(2.78, 2.72, -1.48),
    Pose2D(2.4, 4.3, 2.6),
)


@pytest.mark.gl
@pytest.mark.parametrize("view", VIEWS)
def test_parts_of_furniture_are_no_things(flat: "StillFlat", view: Pose2D) -> None:
    flat.scatter(3)
    flat.stand(view, head_tilt=0.3)
    cloud = flat.cloud()
    for one in detect(cloud, find_supports(cloud)):
        if one.truncated or is_cushion(view.outward(*one.position_m[:2])):
            continue
        place = np.array(view.outward(*one.position_m[:2]))
        gaps = [np.linalg.norm(flat.truth(name)[:2] - place) for name in flat.world.objects]
        assert min(gaps) < 0.06, one


def is_cushion(place: tuple[float, float]) -> bool:
    """Return whether this is the sofa's cushion that stands by itself, a thing by all measures."""
    return math.dist(place, (2.8, 0.39)) < 0.1


# Near a sofa's back, a wall, a bed's edge: body, height of its middle above the support.
NEAR = (
    ("red_cup", (2.35, 0.40, 0.42 + 0.0475), Pose2D(2.35, 1.9, -math.pi / 2)),
    ("bottle", (0.08, 3.85, 0.5 + 0.09), Pose2D(1.0, 3.85, math.pi)),
    ("book", (1.85, 4.9, 0.435 + 0.02), Pose2D(2.6, 4.9, math.pi)),
    ("box", (2.35, 0.47, 0.42), Pose2D(2.35, 1.9, -math.pi / 2)),
)


@pytest.mark.gl
@pytest.mark.parametrize(("name", "place", "view"), NEAR)
def test_things_close_to_furniture_stay(
    flat: "StillFlat", name: str, place: tuple[float, float, float], view: Pose2D
) -> None:
    flat.scatter(0)
    flat.put(name, place)
    flat.stand(view, head_tilt=0.6)
    cloud = flat.cloud()
    found = detect(cloud, find_supports(cloud))
    gaps = [math.dist(view.outward(*one.position_m[:2]), place[:2]) for one in found]
    assert min(gaps) < 0.05
