import pytest

from sim_twin.errors import TwinModelMismatch
from sim_twin.physics.engine import Engine
from sim_twin.physics.load import load_engine
from vla_deploy.robots import load_robot

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
