"""Draw every view from values that the topics may hold, and validate it against its schema."""

import json
import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import jsonschema_rs
import numpy as np
import pytest

from vla_deploy.ipc import BY_NAME
from vla_deploy.ipc.memory.layout import is_document, record_dtype
from vla_deploy.robots import load_robot
from vla_deploy.telemetry.recording.messages import RunLogs
from vla_deploy.telemetry.schemas.foxglove_json import foxglove_schema, matrix_json
from vla_deploy.telemetry.schemas.views import (
    CHANNELS,
    CONSTANT_VIEWS,
    LOG,
    LOG_SCHEMA,
    VIEWS,
    ViewDrawer,
)

ROBOT = load_robot("butler")
NOW_NS = 1_800_000_000_500_000_000
SCENE = {
    "objects": [
        {
            "id": "cup_1",
            "class": "cup",
            "colour": "red",
            "position_m": [1.0, 2.0, 0.8],
            "size_m": [0.08, 0.08, 0.1],
            "yaw_rad": 0.3,
        }
    ],
    "surfaces": [{"height_m": 0.75, "polygon_m": [[0, 0], [1, 0], [1, 1]]}],
    "bystanders": [
        {"class": "person", "position_m": [2, 0], "width_m": 0.5, "top_m": 1.7, "confidence": 0.9}
    ],
}


def everything(_: str) -> bool:
    return True


def payload_of(topic: str, **fields: Any) -> bytes:
    if is_document(BY_NAME[topic]):
        return json.dumps(SCENE).encode()
    record = np.zeros(1, record_dtype(BY_NAME[topic]))
    for name, value in fields.items():
        record[name] = value
    return record.tobytes()


def drawn(drawer: ViewDrawer, topic: str, stamp_ns: int = NOW_NS, **fields: Any) -> dict[str, Any]:
    payload = payload_of(topic, **fields)
    return {
        channel: json.loads(text)
        for channel, text in drawer.views_of(topic, payload, stamp_ns, everything)
    }


@pytest.fixture
def drawer() -> ViewDrawer:
    return ViewDrawer(ROBOT)


def validate(schema_name: str, message: Mapping[str, Any]) -> None:
    jsonschema_rs.validator_for(foxglove_schema(schema_name)).validate(message)


@pytest.mark.parametrize("view", VIEWS, ids=lambda view: view.channel)
def test_every_view_is_what_its_schema_says(drawer: ViewDrawer, view: Any) -> None:
    validate(view.schema_name, drawn(drawer, view.topic)[view.channel])


@pytest.mark.parametrize("still", CONSTANT_VIEWS, ids=lambda still: still.channel)
def test_what_stays_is_what_its_schema_says(still: Any) -> None:
    validate(still.schema_name, still.draw(ROBOT, NOW_NS))


@pytest.mark.parametrize("channel", CHANNELS, ids=lambda channel: channel.topic)
def test_the_schemas_kept_here_are_named_as_their_channels_say(channel: Any) -> None:
    assert channel.schema["title"] == channel.schema_name


def test_a_view_comes_at_its_own_pace_and_again_when_the_clock_was_set_back(
    drawer: ViewDrawer,
) -> None:
    times_ns = [NOW_NS + after_ns for after_ns in (0, 40_000_000, 80_000_000, 120_000_000, -5)]
    counts = [len(drawn(drawer, "scan", stamp_ns)) for stamp_ns in times_ns]
    assert counts == [1, 0, 0, 1, 1]


def test_what_nobody_wants_is_not_drawn(drawer: ViewDrawer) -> None:
    payload = payload_of("joint_state")
    some = list(drawer.views_of("joint_state", payload, NOW_NS, lambda name: name == "view/joints"))
    assert [channel for channel, _ in some] == ["view/joints"]


def test_a_joint_that_is_not_known_has_a_name_but_no_position(drawer: ViewDrawer) -> None:
    position = np.zeros(32)
    position[0] = np.nan
    shown = drawn(drawer, "joint_state", position=position)
    joints = {joint["name"]: joint for joint in shown["view/joints"]["joints"]}
    assert joints.keys() == set(ROBOT.joint_names)
    assert "position" not in joints[ROBOT.joint_names[0]]
    assert shown["view/frames"]["transforms"] == []


def test_frames_tell_where_the_camera_looks(drawer: ViewDrawer) -> None:
    frames = drawn(drawer, "joint_state")["view/frames"]["transforms"]
    camera = next(frame for frame in frames if frame["child_frame_id"] == "camera")
    assert camera["parent_frame_id"] == "base"
    assert camera["translation"]["z"] > 0.5
    assert {frame["child_frame_id"] for frame in frames} >= set(ROBOT.joint_names)


def test_a_robot_without_a_camera_has_the_frames_of_its_joints() -> None:
    blind = replace(ROBOT, parts=replace(ROBOT.parts, camera=None))
    frames = drawn(ViewDrawer(blind), "joint_state")["view/frames"]["transforms"]
    assert {frame["child_frame_id"] for frame in frames} >= set(ROBOT.joint_names)
    assert "camera" not in {frame["child_frame_id"] for frame in frames}


def test_an_object_is_drawn_where_the_scene_says(drawer: ViewDrawer) -> None:
    entities = drawn(drawer, "scene")["view/scene"]["entities"]
    cup = next(entity for entity in entities if entity["id"] == "object/cup_1")
    assert cup["cubes"][0]["pose"]["position"] == {"x": 1.0, "y": 2.0, "z": 0.8}
    assert cup["texts"][0]["text"] == "cup_1"


@pytest.mark.parametrize("axis", [0, 1, 2])
@pytest.mark.parametrize("angle", [0.0, 0.5, math.pi, -math.pi / 2, 3.0])
def test_a_rotation_becomes_the_quaternion_that_turns_the_same_way(axis: int, angle: float) -> None:
    j, k = (axis + 1) % 3, (axis + 2) % 3
    pose = np.eye(4)
    pose[[j, k, j, k], [j, k, k, j]] = [
        math.cos(angle),
        math.cos(angle),
        -math.sin(angle),
        math.sin(angle),
    ]
    _, quaternion = matrix_json(pose)
    expected = dict.fromkeys("xyz", 0.0) | {"w": math.cos(angle / 2)}
    expected["xyz"[axis]] = math.sin(angle / 2)
    dot = sum(expected[name] * quaternion[name] for name in "xyzw")
    assert abs(dot) == pytest.approx(1.0)


def test_log_lines_of_all_processes_come_in_order_and_once(tmp_path: Any) -> None:
    def line(process: str, stamp_ns: int) -> str:
        return json.dumps(
            {
                "stamp_ns": stamp_ns,
                "level": "WARNING",
                "process": process,
                "message": "late",
                "file": "a.py",
                "line": 3,
            }
        )

    (tmp_path / "control.log").write_text(line("control", 20) + "\n" + line("control", 40) + "\n")
    (tmp_path / "planner.log").write_text(line("planner", 30) + "\n" + '{"message": "cut')
    logs = RunLogs(tmp_path)
    fresh = list(logs.new_lines())
    assert [one.stamp_ns for one in fresh] == [20, 30, 40]
    assert list(logs.new_lines()) == []
    message = json.loads(fresh[0].text(NOW_NS))
    validate(LOG_SCHEMA, message)
    assert (message["name"], message["level"]) == ("control", 3)
    assert LOG in {channel.topic for channel in CHANNELS}
