"""The robot's links, map and camera image are answered over HTTP."""

from typing import Any

import cv2
import numpy as np

from vla_deploy.robots import load_robot


def test_the_robot_comes_as_a_tree_with_the_joints_of_its_file(dashboard: Any) -> None:
    model, robot = dashboard.get("robot/model"), load_robot("butler")
    assert model["joint_names"] == list(robot.joint_names)
    joints = {joint["name"] for link in model["links"] for joint in link["joints"]}
    assert set(robot.joint_names) <= joints
    assert {"kind", "size_m", "position_m", "quaternion", "rgba"} == model["links"][0]["shapes"][
        0
    ].keys()
    assert {zone["name"] for zone in model["zones"]} == {z.name for z in robot.protection.zones}


def test_the_map_says_where_its_picture_lies_and_what_has_a_name(dashboard: Any) -> None:
    told, robot = dashboard.get("map"), load_robot("butler")
    answer = dashboard.client.get("/api/v1/map.png")
    assert answer.headers["content-type"] == "image/png"
    picture: Any = cv2.imdecode(np.frombuffer(answer.content, np.uint8), cv2.IMREAD_GRAYSCALE)
    assert picture.shape == (told["height"], told["width"])
    assert {place["name"] for place in told["places"]} == set(robot.places)
    assert [zone["name"] for zone in told["keep_out"]] == [z.name for z in robot.home.zones]
    start = robot.start_pose
    column = int((start.x_m - told["origin"][0]) / told["resolution_m"])
    row = told["height"] - 1 - int((start.y_m - told["origin"][1]) / told["resolution_m"])
    assert picture[row, column] > 250  # the robot starts where the floor is free


def test_a_picture_is_not_there_before_the_first_one(dashboard: Any) -> None:
    assert dashboard.get("camera.jpg", 404)["error"]["code"] == "no_picture"
    frames = dashboard.robot.space.frame_writer("rgbd")
    stamp_ns = dashboard.link.clock.now_ns()
    frames.put(bytes(32 * 24 * 5), width=32, height=24, stamp_ns=stamp_ns)
    answer = dashboard.client.get("/api/v1/camera.jpg")
    assert answer.headers["content-type"] == "image/jpeg"
    picture: Any = cv2.imdecode(np.frombuffer(answer.content, np.uint8), cv2.IMREAD_COLOR)
    assert picture.shape == (24, 32, 3)
