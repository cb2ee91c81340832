"""A picture is encoded once, and what perception saw is boxed where it is in it."""

import json
import struct
from collections import Counter
from typing import Any

import cv2
import numpy as np
import pytest

from drivers.clock import NS_PER_S
from sim_twin.contracts.scripted import ManualClock
from tests.vla_deploy.dashboard.conftest import payload_of
from vla_deploy.dashboard.live.camera import CameraFeed, Detections
from vla_deploy.dashboard.live.message import LiveMessage, LookTime
from vla_deploy.ipc import SharedSpace
from vla_deploy.robots import load_robot
from vla_deploy.robots.kinematics.model import RobotModel, full_positions
from vla_deploy.robots.kinematics.tree_reader import read_tree

ROBOT = load_robot("butler")
WIDE, HIGH = ROBOT.camera.width, ROBOT.camera.height
X_M, Y_M, YAW_RAD = 1.2, -0.7, 0.9


class Rig:
    """Write what perception would, with the head turned and the robot somewhere."""

    def __init__(self, space: SharedSpace, clock: ManualClock) -> None:
        self.space, self.clock = space, clock
        detections = Detections(space, ROBOT, read_tree(ROBOT.mjcf_path))
        self.feed = CameraFeed(space, detections)
        self.frames = space.frame_writer("rgbd")
        values = full_positions(ROBOT, [("head_pan", 0.4), ("head_tilt", 0.5)])
        self._tell_place(values)
        turned = np.eye(4)
        turned[:2, :2] = np.array(
            ((np.cos(YAW_RAD), -np.sin(YAW_RAD)), (np.sin(YAW_RAD), np.cos(YAW_RAD)))
        )
        turned[:2, 3] = X_M, Y_M
        self.map_from_camera = turned @ RobotModel(ROBOT).camera_pose(values)

    def _tell_place(self, values: Any) -> None:
        count = len(values)
        names = ("velocity", "setpoint", "effort_ratio", "age_s", "error", "torque_enabled")
        rest = {name: np.zeros(count) for name in names}
        self.space.cell_writer("joint_state").put(joint_count=count, position=values, **rest)
        self.space.cell_writer("pose").put(
            x_m=X_M,
            y_m=Y_M,
            yaw_rad=YAW_RAD,
            match_ratio=1.0,
            covariance=np.zeros(9),
            state=0,
            doubt=0,
        )

    def see(self, *optical_m: tuple[float, float, float], seen_s: float = 0.0) -> None:
        """Tell of red cups of 0.1 m at points of the optical frame."""
        cups = [
            {
                "id": f"cup_{number}",
                "class": "cup",
                "colour": "red",
                "confidence": 0.9,
                "position_m": (self.map_from_camera @ (*point, 1.0))[:3].tolist(),
                "size_m": [0.1, 0.1, 0.1],
                "yaw_rad": 0.3,
                "last_seen_ns": self.clock.ns - round(seen_s * NS_PER_S),
            }
            for number, point in enumerate(optical_m)
        ]
        self.space.cell_writer("scene").put_document({"stamp_ns": self.clock.ns, "objects": cups})

    def take(self, width: int = WIDE, height: int = HIGH, shade: int = 128) -> None:
        pixels = np.full(width * height * 5, shade, np.uint8)
        self.frames.put(pixels.tobytes(), width=width, height=height, stamp_ns=self.clock.ns)

    def look(self) -> list[LiveMessage]:
        return list(self.feed.look(LookTime(run_ns=self.clock.ns, wall_ns=self.clock.ns)))


@pytest.fixture
def rig(space: SharedSpace, clock: ManualClock) -> Rig:
    clock.ns = 10 * NS_PER_S
    return Rig(space, clock)


def opened(message: LiveMessage) -> tuple[dict[str, Any], Any]:
    whole = payload_of(message)
    assert isinstance(whole, bytes)
    kind, length = struct.unpack_from("<BI", whole)
    assert kind == 1
    image = cv2.imdecode(np.frombuffer(whole, np.uint8, offset=5 + length), cv2.IMREAD_COLOR)
    return json.loads(whole[5 : 5 + length]), image


def test_a_thing_on_the_optical_axis_is_boxed_in_the_middle_of_the_picture(rig: Rig) -> None:
    rig.see((0.0, 0.0, 1.0))
    rig.take()
    (message,) = rig.look()
    header, image = opened(message)
    assert (header["width"], header["height"], image.shape) == (WIDE, HIGH, (HIGH, WIDE, 3))
    (cup,) = header["detections"]
    assert (cup["id"], cup["class"], cup["colour"], cup["confidence"]) == (
        "cup_0",
        "cup",
        "red",
        0.9,
    )
    left, top, right, bottom = cup["box"]
    assert ((left + right) / 2, (top + bottom) / 2) == pytest.approx(
        ((WIDE - 1) / 2, (HIGH - 1) / 2), abs=1.5
    )
    wide_px = 0.1 * ROBOT.camera.focal_px
    assert wide_px <= right - left <= 1.8 * wide_px


def test_what_is_behind_beside_or_only_remembered_is_not_in_the_picture(rig: Rig) -> None:
    rig.see((0.0, 0.0, -1.0), (5.0, 0.0, 1.0))
    rig.take()
    assert opened(rig.look()[0])[0]["detections"] == []
    rig.see((0.0, 0.0, 1.0), seen_s=5.0)
    rig.take()
    assert opened(rig.look()[0])[0]["detections"] == []


def test_a_large_picture_is_shrunk_and_its_boxes_with_it(rig: Rig) -> None:
    rig.see((0.0, 0.0, 1.0))
    rig.take(640, 480)
    narrow, _ = opened(rig.look()[0])
    assert narrow["width"] == 640
    rig.feed = CameraFeed(rig.space, rig.feed._detections)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("vla_deploy.dashboard.live.camera.WIDEST_PX", 160)
        header, image = opened(rig.look()[0])
    assert image.shape == (120, 160, 3)
    box = np.array(header["detections"][0]["box"])
    assert box == pytest.approx(np.array(narrow["detections"][0]["box"]) / 4, abs=0.1)


def test_a_picture_is_told_once_and_encoded_once(rig: Rig, monkeypatch: pytest.MonkeyPatch) -> None:
    encodings, encode = Counter[str](), cv2.imencode

    def counted(form: str, *rest: Any) -> Any:
        encodings.update((form,))
        return encode(form, *rest)

    monkeypatch.setattr(cv2, "imencode", counted)
    assert rig.look() == []
    assert rig.feed.newest() is None
    rig.take()
    assert len(rig.look()) == 1
    assert rig.look() == []
    rig.feed.begin()
    assert len(rig.look()) == 1
    assert rig.feed.newest() is not None
    assert encodings == {".jpg": 1}


def test_without_scene_or_pose_a_picture_comes_without_boxes(
    space: SharedSpace, clock: ManualClock
) -> None:
    feed = CameraFeed(space, Detections(space, ROBOT, read_tree(ROBOT.mjcf_path)))
    pixels = bytes(WIDE * HIGH * 5)
    space.frame_writer("rgbd").put(pixels, width=WIDE, height=HIGH, stamp_ns=clock.ns)
    (message,) = feed.look(LookTime(run_ns=0, wall_ns=0))
    assert opened(message)[0]["detections"] == []
