"""What the robot tells can be kept in a bag, and read by programs that know nothing of ours."""

import base64
from pathlib import Path
from typing import Any

import pytest
from mcap.reader import make_reader
from rosbags.rosbag2 import Reader, StoragePlugin, Writer
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from sim_twin.harness.processes import ProcessStack

pytestmark = [pytest.mark.stack, pytest.mark.gl, pytest.mark.timeout(900)]

CLIENT = Path(__file__).with_name("bag_client.py").read_text(encoding="utf-8")
OURS = Path(__file__).parents[3] / "ros" / "vla_deploy_msgs" / "msg"
EXPECTED = {
    *("/joint_states", "/odom", "/tf", "/tf_static", "/robot_description", "/scan", "/imu/data"),
    *("/camera/color/image_raw", "/camera/depth/image_raw", "/camera/color/camera_info", "/map"),
    *("/detected_objects", "/diagnostics", "/vla_deploy/state", "/vla_deploy/markers"),
}


@pytest.fixture(scope="module")
def types() -> Any:
    store = get_typestore(Stores.ROS2_JAZZY)
    for file in sorted(OURS.glob("*.msg")):
        text = file.read_text(encoding="utf-8")
        store.register(get_types_from_msg(text, f"vla_deploy_msgs/msg/{file.stem}"))
    return store


def test_a_bag_of_all_that_is_told_is_read_by_others(
    robot: ProcessStack, ros_graph: Any, types: Any, tmp_path: Path
) -> None:
    told = ros_graph.run(CLIENT, "60", *sorted(EXPECTED), timeout_s=300.0)
    assert told.keys() >= EXPECTED
    hashes = {topic: (one["type"], one["hash"]) for topic, one in told.items()}
    assert {topic: types.hash_rihs01(kind) for topic, (kind, _) in hashes.items()} == {
        topic: of for topic, (_, of) in hashes.items()
    }

    bag = tmp_path / "bag"
    with Writer(bag, version=9, storage_plugin=StoragePlugin.MCAP) as writer:
        for topic, one in told.items():
            connection = writer.add_connection(topic, one["type"], typestore=types)
            for i, data in enumerate(one["data"]):
                writer.write(connection, i + 1, base64.b64decode(data))

    with Reader(bag) as reader:
        read = {
            connection.topic: types.deserialize_cdr(data, connection.msgtype)
            for connection, _, data in reader.messages()
        }
    assert read.keys() >= EXPECTED
    assert set(robot.session.document("control_status")) >= {"state"}
    assert "left_elbow" in read["/joint_states"].name
    assert read["/scan"].ranges.shape == (360,)
    image = read["/camera/color/image_raw"]
    assert image.data.size == image.height * image.width * 3
    assert {one.child_frame_id for one in read["/tf"].transforms} >= {"base_link", "odom"}
    with next(bag.glob("*.mcap")).open("rb") as file:
        names = {channel.topic for _, channel, _ in make_reader(file).iter_messages()}
    assert names == read.keys()
