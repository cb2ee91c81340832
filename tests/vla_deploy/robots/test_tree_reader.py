"""The tree that the page draws is the one that the arms are moved by, and that MuJoCo simulates."""

from pathlib import Path

import mujoco
import numpy as np
import pytest

from vla_deploy.robots import load_robot
from vla_deploy.robots.kinematics.model import RobotModel
from vla_deploy.robots.kinematics.tree_reader import read_tree

TURNED = """
<mujoco>
  <compiler {angle}/>
  <default>
    <geom type="box" size="1 1 1" rgba="1 0 0 1"/>
    <default class="arm"><joint type="slide" axis="0 0 2" range="-1 1"/>
      <default class="hand"><joint axis="1 0 0"/></default></default>
  </default>
  <asset><material name="blue" rgba="0 0 1 1"/></asset>
  <worldbody>
    <body name="root">
      <body name="a" pos="1 2 3" euler="{a} {b} {c}" childclass="arm">
        <joint name="lift"/><geom group="3"/>
        <body name="b" axisangle="1 2 3 {b}">
          <joint name="reach" class="hand"/><geom type="sphere" size="0.1 0 0" material="blue"/>
          <body name="c" xyaxes="0 1 0.2 -1 0.1 0"><geom type="capsule" size="0.1"
              fromto="0 0 0 0 1 1"/>
            <body name="d" zaxis="1 -1 0.5"><site name="tip" pos="0.1 0.2 0.3" quat="1 2 3 4"/>
            </body></body></body></body></body>
  </worldbody>
</mujoco>
"""


def test_every_site_is_where_the_kinematics_of_the_arms_have_it() -> None:
    robot = load_robot("butler")
    tree, model = read_tree(robot.mjcf_path), RobotModel(robot)
    rng = np.random.default_rng(0)
    for _ in range(5):
        values = rng.uniform(robot.position_min, robot.position_max)
        named = dict(zip(robot.joint_names, values, strict=True))
        for site in ("lidar", "left_grip", "right_grip", robot.camera.site):
            pose = tree.site_pose(site, named)
            assert np.allclose(pose, model.site_pose(site, values), atol=1e-5)


def test_joints_and_shapes_of_the_robot_are_all_there() -> None:
    robot = load_robot("butler")
    tree = read_tree(robot.mjcf_path)
    joints = {joint.name: joint for link in tree.links for joint in link.joints}
    assert set(robot.joint_names) <= joints.keys()
    assert joints["left_gripper_mimic"].follows == "left_gripper"
    assert joints["left_elbow"].range == (0.0, 2.6)
    assert joints["left_gripper"].kind == "slide"
    assert all(link.shapes for link in tree.links)
    colours = {shape.rgba for link in tree.links for shape in link.shapes}
    assert (0.95, 0.945, 0.93, 1.0) in colours  # the shell's material
    known = {""}
    for link in tree.links:
        assert link.parent in known
        known.add(link.name)


@pytest.mark.parametrize("angle", ['angle="radian"', "", 'angle="degree" eulerseq="ZYx"'])
def test_every_way_to_turn_a_frame_means_what_mujoco_takes_it_for(
    tmp_path: Path, angle: str
) -> None:
    scale = 1.0 if "radian" in angle else 57.3
    path = tmp_path / "turned.xml"
    path.write_text(TURNED.format(angle=angle, a=0.3 * scale, b=-0.7 * scale, c=1.1 * scale))
    tree = read_tree(path)
    model = mujoco.MjModel.from_xml_path(str(path))
    data = mujoco.MjData(model)
    data.qpos[:] = (0.4, -0.2)
    mujoco.mj_kinematics(model, data)
    pose = tree.site_pose("tip", {"lift": 0.4, "reach": -0.2})
    assert np.allclose(pose[:3, 3], data.site("tip").xpos, atol=1e-5)
    assert np.allclose(pose[:3, :3].ravel(), data.site("tip").xmat, atol=1e-5)


def test_shapes_have_the_size_place_and_colour_of_mujocos(tmp_path: Path) -> None:
    path = tmp_path / "turned.xml"
    path.write_text(TURNED.format(angle='angle="radian"', a=0, b=0.1, c=0))
    shapes = {link.name: link.shapes for link in read_tree(path).links}
    model = mujoco.MjModel.from_xml_path(str(path))
    assert shapes["a"] == ()  # hidden, for others are shown
    (ball,), (capsule,) = shapes["b"], shapes["c"]
    assert (ball.kind, ball.size_m, ball.rgba) == ("sphere", (0.1,), (0.0, 0.0, 1.0, 1.0))
    geom = model.geom(2)
    assert np.allclose(capsule.size_m, geom.size[:2])
    assert np.allclose(capsule.position_m, geom.pos)
    assert abs(np.dot(np.roll(capsule.quaternion, 1), geom.quat)) == pytest.approx(1.0, abs=1e-6)
    assert capsule.rgba == (1.0, 0.0, 0.0, 1.0)


def test_a_hinge_beside_its_bodys_origin_turns_as_mujocos(tmp_path: Path) -> None:
    path = tmp_path / "door.xml"
    door = """<mujoco><worldbody><body name="root"><body name="door" pos="1 0 0" euler="0 0 30">
      <joint name="post" axis="0 0.2 1" pos="0.3 -0.1 0.2"/>
      <geom name="leaf" type="box" size="0.02" fromto="0 0 0 0.3 0.2 0.1"/>
      <site name="knob" pos="0.4 0 0"/></body></body></worldbody></mujoco>"""
    path.write_text(door)
    tree, model = read_tree(path), mujoco.MjModel.from_xml_path(str(path))
    data = mujoco.MjData(model)
    data.qpos[:] = 0.7
    mujoco.mj_kinematics(model, data)
    pose = tree.site_pose("knob", {"post": 0.7})
    assert np.allclose(pose[:3, 3], data.site("knob").xpos, atol=1e-9)
    assert np.allclose(pose[:3, :3].ravel(), data.site("knob").xmat, atol=1e-9)
    (leaf,) = tree.links[1].shapes
    assert np.allclose(leaf.size_m, model.geom("leaf").size)
