"""A robot and a world become one model, whose bodies and joints start where they should."""

import warnings
from pathlib import Path

import mujoco
import pytest

from sim_twin.errors import TwinModelMismatch
from sim_twin.physics.compose import ROBOT_COLLISION_GROUP, ROBOT_LOOKS_GROUP, compose
from sim_twin.physics.engine import Engine
from sim_twin.physics.load import load_engine
from vla_deploy.robots import load_robot


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


DEEP_M = -0.002


@pytest.fixture(scope="module")
def butler() -> Engine:
    return load_engine(load_robot("butler"), "flat", seed=3)


def test_nothing_starts_inside_anything_else(butler: Engine) -> None:
    contacts = butler.data.contact
    deep = [butler.model.geom(g).name for g in contacts.geom[contacts.dist < DEEP_M].ravel()]
    assert deep == []


def test_the_robot_starts_at_its_start_pose(butler: Engine) -> None:
    start = load_robot("butler").start_pose
    pose = butler.referee.truth()["robot"]
    assert (pose["x_m"], pose["y_m"]) == pytest.approx((start.x_m, start.y_m))


def test_mimic_fingers_start_where_their_leaders_are(butler: Engine) -> None:
    joints = butler.referee.truth()["joints"]
    assert joints["left_gripper_mimic"]["position"] == joints["left_gripper"]["position"] > 0.0


def test_another_seed_moves_the_objects_and_not_the_robot(butler: Engine) -> None:
    other = load_engine(load_robot("butler"), "flat", seed=4).referee.truth()
    truth = butler.referee.truth()
    assert other["robot"] == truth["robot"]
    assert other["objects"]["red_cup"] != truth["objects"]["red_cup"]


def test_an_unknown_world_is_refused_with_what_there_is() -> None:
    with pytest.raises(TwinModelMismatch, match=r"'moon'.*flat"):
        load_engine(load_robot("butler"), "moon", seed=0)
