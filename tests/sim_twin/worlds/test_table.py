"""The table takes a fixed arm in; what lies on it is within reach, apart, and lies still."""

from itertools import combinations
from math import dist, hypot

import mujoco
import numpy as np
import pytest

from sim_twin.physics.compose import ROBOT_ROOT, compose
from sim_twin.worlds import draw_poses, load_world
from vla_deploy.robots.loader import ROBOTS_DIR

SEEDS = range(50)
PAN_AXIS_M = 0.0388
"""How far ahead of its base the SO-101 turns."""
REACH_M = (0.12, 0.32)
WIDEST_M = {"red_block": 0.018, "blue_block": 0.018, "bowl": 0.05}
REST = (0.0, -1.609, 1.607, 0.639, 0.0, 0.0)
MOVED_M = 0.001


@pytest.fixture(scope="module")
def arm() -> mujoco.MjModel:
    """The SO-101 on the table."""
    world = load_world("table")
    return compose(ROBOTS_DIR / "so101" / "so101.xml", world.mjcf_path, world.mount)


def laid(model: mujoco.MjModel, seed: int) -> mujoco.MjData:
    data = mujoco.MjData(model)
    data.qpos[-len(REST) :] = REST
    for name, pose in draw_poses("table", seed).items():
        half = pose.yaw_rad / 2
        data.joint(name).qpos[:] = [*pose.position_m, np.cos(half), 0, 0, np.sin(half)]
    mujoco.mj_forward(model, data)
    return data


def test_each_object_of_the_file_is_a_free_body_of_the_world_and_the_reverse() -> None:
    world = load_world("table")
    model = mujoco.MjModel.from_xml_path(str(world.mjcf_path))
    free = {model.body(model.jnt_bodyid[joint]).name for joint in range(model.njnt)}

    assert free == set(world.objects) == set(WIDEST_M)


def test_the_arm_is_mounted_on_the_top_near_its_edge(arm: mujoco.MjModel) -> None:
    world = load_world("table")
    top = arm.geom("table")
    assert world.mount is not None
    x_m, y_m, z_m = world.mount.position_m

    assert z_m == pytest.approx(top.pos[2] + top.size[2]) == world.surfaces["table"] == 0.75
    assert 0.05 < x_m - (top.pos[0] - top.size[0]) < 0.15
    assert (y_m, world.mount.yaw_rad) == (0.0, 0.0)
    assert arm.body(ROBOT_ROOT).pos == pytest.approx(world.mount.position_m)


def test_every_seed_puts_the_things_within_reach_and_apart() -> None:
    for seed in SEEDS:
        poses = draw_poses("table", seed)
        for name, pose in poses.items():
            x_m, y_m, _ = pose.position_m
            radius_m = hypot(x_m - PAN_AXIS_M, y_m)
            assert REACH_M[0] < radius_m < REACH_M[1] - WIDEST_M[name], (seed, name)
        for one, other in combinations(poses, 2):
            gap_m = dist(poses[one].position_m[:2], poses[other].position_m[:2])
            assert gap_m > WIDEST_M[one] + WIDEST_M[other] + 0.02, (seed, one, other)


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_things_lie_still_and_touch_only_the_table(arm: mujoco.MjModel, seed: int) -> None:
    data = laid(arm, seed)
    for _ in range(500):
        mujoco.mj_step(arm, data)

    for name, pose in draw_poses("table", seed).items():
        assert dist(data.body(name).xpos, pose.position_m) < MOVED_M, name
    bodies = arm.geom_bodyid[data.contact.geom[: data.ncon]]
    things = {arm.body(name).id for name in WIDEST_M}
    partners = {int(b) for pair in bodies for b in pair if things & set(pair.tolist())}
    assert partners <= {0, *things}  # what sleeps has no contacts


def test_the_bowl_is_a_hollow_with_a_rim_of_a_hand() -> None:
    model = mujoco.MjModel.from_xml_path(str(load_world("table").mjcf_path))
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    bowl = model.body("bowl").id
    geoms = np.flatnonzero(model.geom_bodyid == bowl)
    corners = np.array(np.meshgrid([-1, 1], [-1, 1], [-1, 1])).reshape(3, -1)
    points = np.concatenate(
        [
            (data.geom_xmat[g].reshape(3, 3) @ (corners * model.geom_size[g][:, None])).T
            + data.geom_xpos[g]
            - data.xpos[bowl]
            for g in geoms
            if model.geom_type[g] == mujoco.mjtGeom.mjGEOM_BOX
        ]
    )
    above = data.xpos[bowl] + (0.0, 0.0, 0.2)
    hit = np.zeros(1, np.int32)
    depth_m = mujoco.mj_ray(model, data, above, (0.0, 0.0, -1.0), None, 1, -1, hit)

    assert 2 * np.hypot(*points.T[:2]).max() == pytest.approx(0.1, abs=0.006)
    assert points[:, 2].max() == pytest.approx(0.04, abs=0.002)
    assert 0.2 - depth_m == pytest.approx(0.004, abs=0.001)
