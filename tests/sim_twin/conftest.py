from pathlib import Path

import mujoco
import pytest

from sim_twin.physics.compose import compose
from sim_twin.physics.engine import Engine
from sim_twin.physics.shafts import Shaft

ROBOT = """
<mujoco model="cart">
  <compiler angle="radian" autolimits="true"/>
  <worldbody>
    <body name="base">
      <freejoint name="base"/>
      <geom type="box" size="0.2 0.2 0.1" pos="0 0 0.1" mass="5"/>
      <site name="lidar" pos="0 0 0.3"/>
      <site name="imu" pos="0 0 0.1"/>
      <body name="arm" pos="0 0 0.2">
        <joint name="arm" axis="0 0 1" range="-2 2" armature="0.01" damping="0.1"/>
        <geom type="capsule" size="0.02" fromto="0 0 0.05 0.3 0 0.05" mass="0.2"/>
        <camera name="head_camera" pos="0 0 0.2" quat="0.5 0.5 -0.5 -0.5" fovy="60"/>
      </body>
      <body name="finger" pos="0.3 0 0.5">
        <joint name="finger" type="slide" axis="0 1 0" range="0.01 0.04" armature="0.05"/>
        <geom type="box" size="0.01 0.01 0.01" mass="0.1"/>
      </body>
    </body>
  </worldbody>
  <actuator>
    <motor name="arm" joint="arm" ctrlrange="-1 1" ctrllimited="true"/>
    <motor name="finger" joint="finger" gear="50" ctrlrange="-1 1" ctrllimited="true"/>
  </actuator>
  <sensor><accelerometer name="imu_accelerometer" site="imu"/></sensor>
</mujoco>
"""

WORLD = """
<mujoco model="room">
  <worldbody>
    <light pos="0 0 3"/>
    <geom type="plane" size="5 5 0.1"/>
    <geom name="wall" type="box" size="0.1 3 1" pos="2.1 0 1" rgba="0.2 0.4 0.8 1"/>
    <body name="box" pos="0 2 0">
      <geom type="box" size="0.1 0.1 0.005" pos="0 0 0.005"/>
      <geom type="box" size="0.005 0.1 0.05" pos="0.1 0 0.05"/>
      <geom type="box" size="0.005 0.1 0.05" pos="-0.1 0 0.05"/>
      <geom type="box" size="0.1 0.005 0.05" pos="0 0.1 0.05"/>
      <geom type="box" size="0.1 0.005 0.05" pos="0 -0.1 0.05"/>
    </body>
    <body name="cup" pos="0 1 0.03">
      <freejoint name="cup"/>
      <geom type="cylinder" size="0.03 0.03" mass="0.1"/>
    </body>
  </worldbody>
</mujoco>
"""


@pytest.fixture
def room(tmp_path: Path) -> mujoco.MjModel:
    robot, world = tmp_path / "robot.xml", tmp_path / "world.xml"
    robot.write_text(ROBOT)
    world.write_text(WORLD)
    return compose(robot, world)


@pytest.fixture
def engine(room: mujoco.MjModel) -> Engine:
    return Engine(room, [Shaft(joint="arm", offset=0.5, ratio=-1.0)], [])
