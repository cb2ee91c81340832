"""Draw the messages that viewers get, and look at the entities as plain data."""

import base64
import json
import math
from typing import Any

import numpy as np
import pytest

from vla_deploy.ipc import BY_NAME, TOPICS, TopicKind
from vla_deploy.ipc.memory.layout import is_document, record_dtype
from vla_deploy.robots import load_robot
from vla_deploy.telemetry.channels import TICKS, TOPIC_CHANNELS
from vla_deploy.telemetry.rerun import drawing
from vla_deploy.telemetry.rerun.entity import Entity
from vla_deploy.telemetry.rerun.plots import plotted
from vla_deploy.telemetry.rerun.table import VIEWS, MessageDrawer, is_drawn
from vla_deploy.telemetry.schemas import views
from vla_deploy.telemetry.schemas.views import ViewDrawer

ROBOT = load_robot("butler")
NOW_NS = 1_800_000_000_500_000_000
EMPTY_SCENE: dict[str, Any] = {"objects": [], "surfaces": [], "bystanders": []}


def drafted() -> dict[str, bytes]:
    """Return what Foxglove gets of every view of a robot that stands still, by channel."""
    drawer = ViewDrawer(ROBOT)
    messages = dict(drawer.constant_views(NOW_NS, lambda _: True))
    for topic in {view.topic for view in views.VIEWS}:
        declared = BY_NAME[topic]
        payload = (
            json.dumps(EMPTY_SCENE).encode()
            if is_document(declared)
            else np.zeros(1, record_dtype(declared)).tobytes()
        )
        messages.update(drawer.views_of(topic, payload, NOW_NS, lambda _: True))
    return messages


def drawn(channel: str, document: Any) -> dict[str, Entity]:
    entities = MessageDrawer().draw(channel, json.dumps(document).encode()).entities
    return {entity.path: entity for entity in entities}


def test_every_view_that_foxglove_gets_is_drawn_where_the_table_says() -> None:
    rows = {row.channel: row for row in VIEWS}
    messages = drafted()
    assert messages.keys() == {one.channel for one in views.VIEWS} | {
        one.channel for one in views.CONSTANT_VIEWS
    }
    for channel, text in messages.items():
        entities = MessageDrawer().draw(channel, text).entities
        assert entities, channel
        assert all(one.path.startswith(rows[channel].path) for one in entities)


def test_images_logs_events_ticks_and_packed_cells_are_drawn_as_well() -> None:
    images = [one.topic for one in TOPIC_CHANNELS if "/" in one.topic]
    assert all(map(is_drawn, (*images, views.LOG, TICKS)))
    for topic in TOPICS:
        is_packed = topic.kind is TopicKind.CELL and not is_document(topic)
        assert is_drawn(topic.name) or not is_packed
    assert not is_drawn("page_sound")
    assert MessageDrawer().draw("page_sound", b"private").entities == ()


def test_frames_are_where_their_transforms_place_them_with_axes_that_hold() -> None:
    entities = MessageDrawer().draw("view/frames", drafted()["view/frames"]).entities
    placed = {one.path: one.values for one in entities if one.archetype == "Transform3D"}
    assert {f"world/base/{name}" for name in ROBOT.joint_names} < placed.keys()
    assert placed["world/base/camera"]["translation"][2] > 0.5
    assert all(one.static for one in entities if one.archetype == "TransformAxes3D")


def test_the_arrow_of_a_pose_points_where_the_base_looks() -> None:
    pose = {
        "position": {"x": 1, "y": 2, "z": 0},
        "orientation": {"x": 0, "y": 0, "z": math.sin(math.pi / 4), "w": math.cos(math.pi / 4)},
    }
    values = drawn("view/pose", {"frame_id": "map", "pose": pose})["world/pose"].values
    assert values["origins"] == [[1.0, 2.0, 0.0]]
    assert values["vectors"][0] == pytest.approx([0.0, 0.4, 0.0])


def test_a_scan_is_the_points_of_the_beams_that_came_back() -> None:
    pose = {"position": {"x": 0.1, "y": 0, "z": 0.3}, "orientation": {}}
    message = {"frame_id": "base", "pose": pose, "start_angle": 0.0, "end_angle": math.pi}
    found = drawn("view/scan", {**message, "ranges": [1.0, 0.0, 2.0]})["world/base/scan"]
    expected = [[1.1, 0.0, 0.3], [-1.9, 0.0, 0.3]]
    assert found.values["positions"] == pytest.approx(np.array(expected), abs=1e-6)


def test_a_cloud_is_read_by_its_own_fields() -> None:
    rows = np.array([[9, 1, 2, 3], [9, 4, 5, 6]], "<f4")
    fields = [{"name": axis, "offset": 4 + 4 * i, "type": 7} for i, axis in enumerate("xyz")]
    data = base64.b64encode(rows.tobytes()).decode()
    message = {"frame_id": "base", "point_stride": 16, "fields": fields, "data": data}
    (found,) = drawing.obstacles(message)
    assert found.values["positions"].tolist() == [[1, 2, 3], [4, 5, 6]]


def test_the_maps_first_row_is_the_images_last() -> None:
    cells = np.arange(24, dtype=np.uint8)  # two rows of three cells
    message = {
        "frame_id": "map",
        "column_count": 3,
        "cell_size": {"x": 0.05, "y": 0.05},
        "pose": {"position": {"x": -1, "y": -2, "z": 0}},
        "data": base64.b64encode(cells.tobytes()).decode(),
    }
    (found,) = drawing.grid(message)
    assert found.values["data"] == bytes([12, 16, 20, 0, 4, 8])
    assert (found.values["format"]["width"], found.values["format"]["height"]) == (3, 2)
    assert found.values["translation"] == [-1.0, -2.0, 0.0]


def test_a_scene_without_anything_takes_away_what_was_there() -> None:
    entities = list(drawing.scene({"entities": []}))
    assert {one.path for one in entities} == {
        f"world/scene/{place}" for place in ("boxes", "people", "outlines", "names")
    }
    boxes = next(one for one in entities if one.path == "world/scene/boxes")
    assert boxes.values["centers"] == boxes.values["labels"] == []
    assert list(drawing.zones({"entities": []})) == []


def test_an_image_stands_before_the_camera_as_it_was_compressed() -> None:
    message = {"frame_id": "camera", "format": "png", "data": base64.b64encode(b"png").decode()}
    values = drawn("rgbd/depth", message)["world/base/camera/depth"].values
    assert values == {"blob": b"png", "media_type": "image/png", "meter": 1000}


@pytest.mark.parametrize(("level", "shown"), [(1, "DEBUG"), (3, "WARN"), (5, "CRITICAL")])
def test_a_line_of_a_log_has_its_process_and_its_level(level: int, shown: str) -> None:
    message = {"name": "stop door/1", "message": "late", "level": level}
    values = drawn("view/log", message)["logs/stop_door_1"].values
    assert values == {"text": "late", "level": shown}


def test_a_plot_has_the_robots_joints_and_a_gap_where_nothing_is_known() -> None:
    document = {"joint_count": 2, "position": [0.5, None, 0.0], "future": [1]}
    (found,) = drawn("joint_state", document).values()
    assert found.path == "plots/joint_state/position"
    first, second = found.values["scalars"]
    assert first == 0.5
    assert math.isnan(second)


def test_beams_and_points_are_drawn_and_not_plotted() -> None:
    assert plotted("scan") == ()
    assert [field.name for field in plotted("near_obstacles")] == ["count", "period_s"]


def test_joints_are_named_in_every_plot_that_has_a_curve_for_each() -> None:
    entities = MessageDrawer().draw("view/joints", drafted()["view/joints"]).entities
    named = {one.path: one.values["names"] for one in entities}
    assert named["plots/joint_state/position"] == list(ROBOT.joint_names)
    assert named.keys() >= {"plots/tick_record/sent", "plots/control_status/joints/temperature_c"}


def test_numbers_of_documents_are_plotted_by_tick_and_missing_ones_are_not() -> None:
    document = {"tick": 7, "period_s": 0.004, "joints": {"temperature_c": [40.5, None]}}
    found = MessageDrawer().draw("control_status", json.dumps(document).encode())
    assert found.tick == 7
    assert [one.path for one in found.entities] == [
        "plots/control_status/period_s",
        "plots/control_status/joints/temperature_c",
    ]
    older = MessageDrawer().draw("control_status", b'{"period_s": 0.004, "joints": null}')
    assert (older.tick, len(older.entities)) == (None, 1)
