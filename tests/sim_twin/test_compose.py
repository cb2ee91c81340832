import warnings
from pathlib import Path

import mujoco
import pytest

from sim_twin.errors import TwinModelMismatch
from sim_twin.physics.compose import ROBOT_COLLISION_GROUP, ROBOT_LOOKS_GROUP, compose


def test_the_composed_model_has_what_grasps_need(room: mujoco.MjModel) -> None:
    assert room.opt.timestep == 0.002
    assert room.opt.cone == mujoco.mjtCone.mjCONE_ELLIPTIC
    assert room.opt.impratio == 100.0


def test_only_the_robots_geoms_are_in_the_robots_groups(room: mujoco.MjModel) -> None:
    root = room.body("base").id
    mine = room.body_rootid[room.geom_bodyid] == root
    robot_groups = {ROBOT_LOOKS_GROUP, ROBOT_COLLISION_GROUP}
    assert set(room.geom_group[mine]) <= robot_groups
    assert robot_groups.isdisjoint(room.geom_group[~mine])


def test_composing_says_nothing_and_leaves_no_log(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    robot, world = tmp_path / "robot.xml", tmp_path / "world.xml"
    robot.write_text('<mujoco><worldbody><body name="base"/></worldbody></mujoco>')
    world.write_text("<mujoco/>")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        compose(robot, world)
    assert capfd.readouterr().err == ""
    assert not (tmp_path / "MUJOCO_LOG.TXT").exists()


def test_a_robot_without_a_base_is_refused_with_its_path(tmp_path: Path) -> None:
    robot, world = tmp_path / "robot.xml", tmp_path / "world.xml"
    robot.write_text('<mujoco><worldbody><body name="trunk"/></worldbody></mujoco>')
    world.write_text("<mujoco/>")
    with pytest.raises(TwinModelMismatch, match=r"robot\.xml: expected a root body named 'base'"):
        compose(robot, world)


def test_broken_xml_is_refused_with_its_path(tmp_path: Path) -> None:
    robot = tmp_path / "robot.xml"
    robot.write_text("<mujoco><nonsense/></mujoco>")
    with pytest.raises(TwinModelMismatch, match=r"robot\.xml"):
        compose(robot, robot)
