"""The perception process on simulated time: real drivers, emulated sensors, rendered images."""

import math
from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np
import pytest

from vla_deploy.robots.floor_pose import Pose2D

if TYPE_CHECKING:
    from conftest import Rig, StillFlat

pytestmark = pytest.mark.gl

VIEW = Pose2D(2.2, 2.05, -math.pi / 2)
MakeRig = Callable[..., "Rig"]


def test_the_scene_is_right_in_the_map_although_the_start_was_wrong(
    make_rig: MakeRig,
) -> None:
    rig = make_rig(VIEW.compose(Pose2D(0.06, -0.05, 0.04)))
    rig.run_for(4.0)
    position_m, yaw_rad = rig.pose_error()
    assert position_m < 0.03
    assert yaw_rad < 0.01
    assert rig.cell("pose")["match_ratio"] > 0.7
    things = rig.known()
    assert {"cup_1", "ball_1", "book_1"} <= set(things)
    for thing, body in (("cup_1", "red_cup"), ("ball_1", "blue_ball"), ("book_1", "book")):
        truth = rig.flat.truth(body)
        assert math.dist(things[thing]["position_m"], truth) < 0.035
    assert (things["cup_1"]["class"], things["cup_1"]["colour"]) == ("cup", "red")


def test_a_robot_that_finds_out_where_it_is_has_not_moved_its_camera(make_rig: MakeRig) -> None:
    rig = make_rig(VIEW.compose(Pose2D(0.5, -0.4, 2.46)))
    for _ in range(20):
        rig.run_for(1.0)
        assert rig.scene()["image"]["use"] == "all"
        if rig.pose_error()[0] < 0.05:
            break
    rig.run_for(2.0)
    assert rig.pose_error()[0] < 0.05
    assert rig.scene()["image"] == {"use": "all", "faults": [], "refused": 0}


def test_the_table_is_told_as_a_surface_with_its_height_and_outline(
    make_rig: MakeRig,
) -> None:
    rig = make_rig()
    rig.run_for(1.0)
    table = min(rig.scene()["surfaces"], key=lambda s: abs(s["height_m"] - 0.45))
    assert table["height_m"] == pytest.approx(0.45, abs=0.005)
    outline = np.array(table["polygon_m"])
    # The coffee table covers 1.7..2.7 m by 1.28..1.72 m.
    assert outline.min(axis=0) == pytest.approx((1.7, 1.28), abs=0.05)
    assert outline.max(axis=0) == pytest.approx((2.7, 1.72), abs=0.05)
    assert all(surface["height_m"] > 0.1 for surface in rig.scene()["surfaces"])


def test_every_topic_is_published(make_rig: MakeRig) -> None:
    rig = make_rig()
    rig.run_for(1.0)
    assert np.count_nonzero(rig.cell("scan")["range_m"]) > 300
    assert rig.cell("imu")["acceleration_m_s2"][2] == pytest.approx(9.81, abs=0.3)
    frame = rig.space.frame_reader("rgbd").latest()
    assert frame is not None
    assert (frame.width, frame.height) == (512, 384)
    assert len(frame.payload) == 512 * 384 * 5
    rgb, _ = rig.flat.camera.render()
    assert frame.payload[: rgb.size] == rgb.tobytes()


def test_driving_is_followed_better_than_by_wheels_alone(make_rig: MakeRig) -> None:
    rig = make_rig()
    rig.run_for(0.5)
    began = rig.now / 1e9

    def drive(t: float) -> Pose2D:
        angle = 0.5 * (t - began)
        return VIEW.compose(Pose2D(-0.25 * (t - began), 0.0, 0.0)).compose(Pose2D(0, 0, angle))

    rig.base = drive
    rig.head_tilt = lambda _: 0.2
    rig.run_for(4.0)
    position_m, yaw_rad = rig.pose_error()
    assert position_m < 0.05
    assert yaw_rad < 0.03


def test_a_restarted_process_knows_where_the_robot_is(make_rig: MakeRig) -> None:
    make_rig().run_for(0.5)
    restarted = make_rig(believed=Pose2D(VIEW.x_m + 1.5, VIEW.y_m, VIEW.yaw_rad + 1.0))
    restarted.run_for(1.0)
    position_m, yaw_rad = restarted.pose_error()
    assert position_m < 0.05
    assert yaw_rad < 0.03


def test_images_taken_while_the_head_turns_are_shown_but_not_believed(
    make_rig: MakeRig,
) -> None:
    rig = make_rig()
    rig.run_for(1.0)
    before = rig.scene()["stamp_ns"]
    began = rig.now / 1e9
    rig.head_tilt = lambda t: 0.5 + 0.6 * abs(((t - began) % 1.0) - 0.5)
    rig.run_for(1.0)
    assert rig.scene()["stamp_ns"] <= before + 300_000_000
    frame = rig.space.frame_reader("rgbd").latest()
    assert frame is not None
    assert frame.stamp_ns > before + 600_000_000
    rig.head_tilt = lambda _: 0.75
    rig.run_for(0.6)
    assert rig.scene()["stamp_ns"] > before + 1_000_000_000


def test_a_lost_camera_is_reopened_and_the_rest_goes_on(make_rig: MakeRig) -> None:
    rig = make_rig()
    rig.run_for(0.5)
    rig.lines["camera"].unplug()
    scans = rig.sample("scan")
    rig.run_for(0.5)
    during = rig.sample("scan")
    assert list(rig.scene()["away"]) == ["camera"]
    assert "unplugged" in rig.scene()["away"]["camera"]
    assert during.sequence > scans.sequence
    unplugged_ns = rig.scene()["stamp_ns"]
    rig.lines["camera"].replug()
    rig.run_for(1.5)
    assert rig.scene()["stamp_ns"] > unplugged_ns + 1_000_000_000
    assert rig.scene()["away"] == {}


@pytest.mark.parametrize(("sensor", "topic"), [("lidar", "scan"), ("imu", "imu")])
def test_a_lost_lidar_or_imu_leaves_its_topic_stale_until_it_is_back(
    make_rig: MakeRig, sensor: str, topic: str
) -> None:
    rig = make_rig()
    rig.run_for(0.5)
    rig.lines[sensor].unplug()
    rig.run_for(0.1)
    lost = rig.sample(topic)
    rig.run_for(0.8)
    still = rig.sample(topic)
    assert still.sequence == lost.sequence
    assert list(rig.scene()["away"]) == [sensor]
    rig.lines[sensor].replug()
    rig.run_for(1.5)
    back = rig.sample(topic)
    assert back.sequence > lost.sequence
    assert rig.scene()["away"] == {}


def test_a_cup_that_is_carried_off_is_forgotten_and_keeps_its_id_elsewhere(
    make_rig: MakeRig,
) -> None:
    rig = make_rig()
    rig.run_for(1.0)
    assert "cup_1" in rig.known()
    rig.flat.put("red_cup", (6.3, 4.4, 0.5475))
    rig.run_for(1.6)
    assert "cup_1" not in rig.known()
    assert "ball_1" in rig.known()
    rig.flat.put("red_cup", (2.2, 1.42, 0.4975))
    rig.run_for(1.0)
    assert math.dist(rig.known()["cup_1"]["position_m"][:2], (2.2, 1.42)) < 0.03


def test_what_moves_while_the_camera_is_away_is_not_noticed(make_rig: MakeRig) -> None:
    """All that perception knows of things has come over the camera's wire."""
    rig = make_rig()
    rig.run_for(1.0)
    before = rig.known()["cup_1"]
    rig.lines["camera"].unplug()
    rig.flat.put("red_cup", (6.3, 4.4, 0.5475))
    rig.run_for(1.0)
    assert rig.known()["cup_1"] == before


def reach(flat: "StillFlat", target: np.ndarray) -> dict[str, float]:
    """Return right-arm joints that bring the grip near a point of the base frame."""
    random = np.random.default_rng(0)
    names = flat.robot.groups["right_arm"].joints
    spans = [(flat.robot.limits[name].min, flat.robot.limits[name].max) for name in names]
    tries = [
        dict(zip(names, (random.uniform(*s) for s in spans), strict=True)) for _ in range(4000)
    ]

    def gap_m(joints: dict[str, float]) -> float:
        grip = flat.kinematics.site_pose("right_grip", flat.positions(**joints))[:3, 3]
        return float(np.linalg.norm(grip - target))

    return min(tries, key=gap_m)


def test_a_cup_in_the_hand_goes_where_the_hand_goes(make_rig: MakeRig) -> None:
    rig = make_rig()
    rig.flat.put("book", (6.3, 4.0, 0.5475))  # it would lie where the cup is put
    rig.flat.put("red_cup", (2.1, 1.62, 0.4975))
    rig.run_for(1.0)
    cup = rig.known()["cup_1"]["position_m"]
    local = Pose2D(cup[0], cup[1], 0.0).relative_to(VIEW)
    rig.arm = reach(rig.flat, np.array([local.x_m, local.y_m, cup[2]]))
    rig.pressing = "right_gripper"
    rig.run_for(0.1)
    status = rig.space.cell_writer("executor_status")
    status.put_document({"holding": {"left": None, "right": "cup"}})
    rig.run_for(0.1)
    rig.arm["right_shoulder_yaw"] += 0.1
    rig.flat.put("red_cup", (6.3, 4.4, 0.5475))  # out of sight: only the hand tells
    rig.run_for(1.5)
    grip = rig.flat.kinematics.site_pose("right_grip", rig.flat.joints)[:3, 3]
    placed = VIEW.compose(Pose2D(grip[0], grip[1], 0.0))
    told = rig.known()["cup_1"]["position_m"]
    assert told == pytest.approx((placed.x_m, placed.y_m, grip[2]), abs=0.02)
