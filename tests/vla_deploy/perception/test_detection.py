"""Detection on images rendered in the twin's flat, against the truth."""

import math
from typing import TYPE_CHECKING

import numpy as np
import pytest

from vla_deploy.perception.geometry.supports import find_supports
from vla_deploy.perception.images.detection import Detection, detect
from vla_deploy.robots.floor_pose import Pose2D

if TYPE_CHECKING:
    from conftest import StillFlat

pytestmark = pytest.mark.gl

LOOK_RAD = {"coffee_table": 0.75, "kitchen_table": 0.75, "bedside_table": 0.8, "side_table": 0.85}
BOX_RIM_M = 0.128


def see(flat: "StillFlat", seed: int = 0) -> list[tuple[Detection, np.ndarray]]:
    """Return what the robot detects, each with its position in the map."""
    cloud = flat.cloud(seed)
    found = []
    for detection in detect(cloud, find_supports(cloud)):
        x, y, z = detection.position_m
        placed = flat.base.compose(Pose2D(x, y, 0.0))
        found.append((detection, np.array([placed.x_m, placed.y_m, z])))
    return found


def nearest(
    found: list[tuple[Detection, np.ndarray]], truth: np.ndarray
) -> tuple[Detection, np.ndarray]:
    return min(found, key=lambda pair: float(np.linalg.norm(pair[1][:2] - truth[:2])))


@pytest.mark.parametrize("place", LOOK_RAD)
def test_things_on_a_table_have_class_colour_and_place(flat: "StillFlat", place: str) -> None:
    errors: dict[str, list[float]] = {}
    for seed in range(4):
        flat.scatter(seed)
        flat.stand_at_viewpoint(place, head_tilt=LOOK_RAD[place])
        found = see(flat, seed)
        for item in flat.world.objects.values():
            if item.surface != place:
                continue
            truth = flat.truth(item.name)
            detection, position = nearest(found, truth)
            assert (detection.class_name, detection.colour) == (item.class_name, item.colour)
            error_m = float(np.linalg.norm(position[:2] - truth[:2]))
            assert error_m < 0.016
            errors.setdefault(item.name, []).append(error_m)
    for name, values in errors.items():
        assert np.median(values) < 0.010, name


def test_heights_are_those_of_the_things(flat: "StillFlat") -> None:
    flat.scatter(0)
    flat.stand_at_viewpoint("coffee_table", head_tilt=0.75)
    found = see(flat)
    for name in ("red_cup", "blue_ball", "book"):
        _, position = nearest(found, flat.truth(name))
        assert position[2] == pytest.approx(flat.truth(name)[2], abs=0.005)
    cup, _ = nearest(found, flat.truth("red_cup"))
    assert cup.size_m == pytest.approx((0.066, 0.066, 0.095), abs=0.006)


def test_a_box_is_placed_by_its_opening(flat: "StillFlat") -> None:
    errors = []
    for seed in range(4):
        flat.scatter(seed)
        flat.stand_at_viewpoint("side_table", head_tilt=0.85)
        truth = flat.truth("box")
        detection, position = nearest(see(flat, seed), truth)
        assert detection.class_name == "box"
        assert detection.size_m == pytest.approx((0.232, 0.232, BOX_RIM_M), abs=0.012)
        rim_m = position[2] + detection.size_m[2] / 2
        assert rim_m == pytest.approx(truth[2] + BOX_RIM_M, abs=0.008)
        errors.append(float(np.linalg.norm(position[:2] - truth[:2])))
    assert max(errors) < 0.015


def test_a_box_whose_side_a_loaded_hand_hides_is_known_to_be_hidden(flat: "StillFlat") -> None:
    flat.scatter(0)
    flat.put("book", (4.036, 0.593, 0.717), yaw_rad=0.6)
    flat.stand(
        Pose2D(3.7326, 0.6152, -0.597),
        left_shoulder_yaw=0.221,
        left_shoulder_pitch=0.097,
        left_elbow=2.399,
        left_wrist_pitch=-2.509,
        left_wrist_roll=0.828,
        head_pan=0.198,
        head_tilt=0.96,
    )
    box, position = nearest(see(flat), flat.truth("box"))
    assert box.class_name == "box"
    assert np.linalg.norm(position[:2] - flat.truth("box")[:2]) > 0.03
    assert box.occluded


def test_a_turned_box_tells_its_yaw(flat: "StillFlat") -> None:
    flat.scatter(0)
    flat.put("box", (4.2, 0.46, 0.42), yaw_rad=0.35)
    flat.stand_at_viewpoint("side_table", head_tilt=0.85)
    detection, _ = nearest(see(flat), flat.truth("box"))
    turned = (detection.yaw_rad + flat.base.yaw_rad - 0.35) % (math.pi / 2)
    assert min(turned, math.pi / 2 - turned) < 0.06


@pytest.mark.parametrize("yaw_rad", [0.0, 0.5, math.pi / 4, 1.1])
def test_a_cup_in_the_box_is_seen_there_as_wide_as_it_is(flat: "StillFlat", yaw_rad: float) -> None:
    flat.scatter(0)
    x, y, z = flat.truth("box")
    flat.put("box", (x, y, z), yaw_rad=yaw_rad)
    flat.put("red_cup", (x, y, z + 0.008 + 0.0475))
    flat.stand_at_viewpoint("side_table", head_tilt=0.85)
    kinds = {(d.class_name, d.colour): d for d, _ in see(flat)}
    assert ("box", "orange") in kinds
    assert kinds["cup", "red"].size_m[:2] == pytest.approx((0.066, 0.066), abs=0.012)


def test_two_things_in_the_box_are_seen_both(flat: "StillFlat") -> None:
    flat.scatter(0)
    x, y, z = flat.truth("box")
    flat.put("red_cup", (x + 0.05, y + 0.05, z + 0.008 + 0.0475))
    flat.put("blue_ball", (x - 0.05, y - 0.05, z + 0.008 + 0.03))
    flat.stand_at_viewpoint("side_table", head_tilt=0.85)
    kinds = {(d.class_name, d.colour) for d, _ in see(flat)}
    assert {("box", "orange"), ("cup", "red"), ("ball", "blue")} <= kinds


def test_things_that_touch_are_told_apart_by_colour(flat: "StillFlat") -> None:
    flat.scatter(0)
    flat.put("red_cup", (2.2, 1.55, 0.4975), yaw_rad=-1.57)
    flat.put("phone", (2.31, 1.55, 0.456))
    flat.put("blue_ball", (1.8, 1.55, 0.475))
    flat.put("book", (2.6, 1.4, 0.47))
    flat.stand_at_viewpoint("coffee_table", head_tilt=0.75)
    found = see(flat)
    for name, kind in (("red_cup", ("cup", "red")), ("phone", ("phone", "black"))):
        detection, _ = nearest(found, flat.truth(name))
        assert (detection.class_name, detection.colour) == kind


def test_furniture_and_walls_are_no_things_to_pick(flat: "StillFlat") -> None:
    flat.scatter(0)
    known = {(item.class_name, item.colour) for item in flat.world.objects.values()}
    for place in ("living_room", "kitchen", "bedroom", "entrance", "charging_station"):
        flat.stand(flat.robot.places[place].pose, head_tilt=0.35)
        for detection, position in see(flat):
            if detection.truncated or detection.class_name == "object":
                continue
            gaps = [
                float(np.linalg.norm(flat.truth(n)[:2] - position[:2])) for n in flat.world.objects
            ]
            assert min(gaps) < 0.05, (place, detection)
            assert (detection.class_name, detection.colour) in known


def test_the_robots_own_arm_is_masked(flat: "StillFlat") -> None:
    flat.scatter(0)
    flat.stand_at_viewpoint(
        "coffee_table",
        head_tilt=0.9,
        right_shoulder_yaw=0.0,
        right_shoulder_pitch=0.9,
        right_elbow=0.8,
        right_wrist_pitch=-0.9,
    )
    _, with_robot = flat.camera.render()
    _, without = flat.view_without_robot()
    shown = with_robot < without - 0.02
    mask = flat.body_mask.mask(flat.joints, flat.intrinsics)
    assert np.count_nonzero(shown) > 3000
    assert np.count_nonzero(shown & mask) > 0.97 * np.count_nonzero(shown)
    assert np.count_nonzero(mask) < 2.0 * np.count_nonzero(shown)
