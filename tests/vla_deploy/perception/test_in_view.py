"""What is in view at a remembered place: the thing itself, something else, or nothing."""

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
import pytest

from vla_deploy.perception.geometry.cloud import Cloud
from vla_deploy.perception.geometry.supports import KnownSurface, counter_clockwise, find_supports
from vla_deploy.perception.images.detection import Detection, Vector, detect
from vla_deploy.perception.objects.scene import is_in_clear_view
from vla_deploy.robots.floor_pose import Pose2D

if TYPE_CHECKING:
    from conftest import StillFlat

pytestmark = pytest.mark.gl

CUP_SIZE_M = (0.07, 0.07, 0.1)
TABLE_M = 0.42
BOX_M = (4.2, 0.456, TABLE_M)
CUP_IN_BOX_M = (4.2, 0.466, 0.475)
CLOSE = Pose2D(4.522, 0.839, -2.506)
THINGS = {("box", "orange"), ("cup", "red")}
TABLE_CORNERS = ((3.95, 0.25), (4.45, 0.25), (4.45, 0.65), (3.95, 0.65))


def look_with_the_table_hidden(flat: "StillFlat", beyond_m: float) -> Cloud:
    """Return the cloud of an image in which an arm hides the table but for what is near the box."""
    cloud = flat.cloud()
    x_m, y_m, _ = local(flat, BOX_M)
    points = cloud.points
    away_m = np.hypot(points[..., 0] - x_m, points[..., 1] - y_m)
    hidden = (np.abs(points[..., 2] - TABLE_M) < 0.03) & (away_m > beyond_m)
    return replace(cloud, valid=cloud.valid & ~hidden)


def local(flat: "StillFlat", place: Vector) -> Vector:
    x_m, y_m, z_m = place
    moved = Pose2D(x_m, y_m, 0.0).relative_to(flat.base)
    return moved.x_m, moved.y_m, z_m


def known_table(flat: "StillFlat") -> KnownSurface:
    corners = [local(flat, (x_m, y_m, 0.0))[:2] for x_m, y_m in TABLE_CORNERS]
    outline = counter_clockwise(np.array(corners, dtype=np.float32))
    return KnownSurface(height_m=TABLE_M, outline=outline)


@pytest.fixture
def boxed(flat: "StillFlat") -> "StillFlat":
    flat.scatter(1)
    flat.put("box", BOX_M)
    flat.put("red_cup", CUP_IN_BOX_M)
    flat.stand(CLOSE, head_tilt=0.85)
    return flat


def names(found: list[Detection]) -> set[tuple[str, str]]:
    return {(one.class_name, one.colour) for one in found}


def test_what_stands_on_a_table_that_it_nearly_covers_is_found_where_the_table_is_known(
    boxed: "StillFlat",
) -> None:
    cloud = look_with_the_table_hidden(boxed, beyond_m=0.2)
    assert not names(detect(cloud, find_supports(cloud))) & THINGS
    supports = find_supports(cloud, [known_table(boxed)])
    assert names(detect(cloud, supports)) >= THINGS


def test_a_known_surface_is_not_believed_where_there_is_none(boxed: "StillFlat") -> None:
    cloud = boxed.cloud()
    elsewhere = KnownSurface(height_m=0.2, outline=known_table(boxed).outline)
    assert len(find_supports(cloud, [elsewhere])) == len(find_supports(cloud))


def test_a_thing_that_stands_there_without_a_name_does_not_show_its_place_without_it(
    boxed: "StillFlat",
) -> None:
    place = local(boxed, CUP_IN_BOX_M)
    assert not is_in_clear_view(place, CUP_SIZE_M, boxed.cloud(), [])


def test_a_box_around_a_place_does_not_explain_what_stands_in_it(boxed: "StillFlat") -> None:
    cloud = boxed.cloud()
    found = detect(cloud, find_supports(cloud, [known_table(boxed)]))
    boxes = [one for one in found if one.class_name == "box"]
    place = local(boxed, CUP_IN_BOX_M)
    assert boxes
    assert not is_in_clear_view(place, CUP_SIZE_M, cloud, boxes)
    assert is_in_clear_view(place, CUP_SIZE_M, cloud, found)


def test_the_place_of_what_was_taken_away_is_in_clear_view(boxed: "StillFlat") -> None:
    boxed.put("red_cup", (2.2, 1.6, 0.5))
    assert is_in_clear_view(local(boxed, CUP_IN_BOX_M), CUP_SIZE_M, boxed.cloud(), [])


@pytest.mark.parametrize(("away_m", "is_clear"), [(0.05, False), (0.12, True)])
def test_a_place_beside_the_robots_own_fingers_is_not_in_clear_view(
    boxed: "StillFlat", away_m: float, is_clear: bool
) -> None:
    boxed.put("red_cup", (2.2, 1.6, 0.5))
    cloud, place = boxed.cloud(), local(boxed, CUP_IN_BOX_M)
    beside = np.abs(cloud.points[..., 1] - place[1] - away_m) < 0.01
    fingers = replace(cloud, own_body=cloud.own_body | beside)
    assert is_in_clear_view(place, CUP_SIZE_M, fingers, []) is is_clear


def test_what_is_out_of_the_image_is_hidden(boxed: "StillFlat") -> None:
    assert not is_in_clear_view((-1.0, 0.0, 0.5), CUP_SIZE_M, boxed.cloud(), [])
