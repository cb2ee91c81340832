from itertools import combinations
from math import dist

import mujoco
import numpy as np
import pytest

from sim_twin.physics.compose import compose
from sim_twin.worlds import draw_poses, load_world
from vla_deploy.robots import load_robot

SEEDS = range(50)


def test_the_same_seed_draws_the_same_poses_and_another_seed_others() -> None:
    assert draw_poses("flat", 7) == draw_poses("flat", 7)
    assert draw_poses("flat", 7) != draw_poses("flat", 8)


def test_objects_lie_inside_their_regions_on_their_surfaces_and_apart() -> None:
    world = load_world("flat")
    for seed in SEEDS:
        poses = draw_poses("flat", seed)
        for name, item in world.objects.items():
            x_m, y_m, z_m = poses[name].position_m
            assert item.x_m[0] <= x_m <= item.x_m[1]
            assert item.y_m[0] <= y_m <= item.y_m[1]
            assert z_m == pytest.approx(world.surfaces[item.surface] + item.rest_height_m)
        for one, other in combinations(poses.values(), 2):
            assert dist(one.position_m[:2], other.position_m[:2]) >= world.min_distance_m


def test_each_object_of_the_file_is_a_free_body_of_the_world_and_the_reverse() -> None:
    world = load_world("flat")
    model = mujoco.MjModel.from_xml_path(str(world.mjcf_path))
    free = {model.body(model.jnt_bodyid[joint]).name for joint in range(model.njnt)}

    assert free == set(world.objects)


def test_drawn_objects_rest_where_they_are_put() -> None:
    world = load_world("flat")
    model = mujoco.MjModel.from_xml_path(str(world.mjcf_path))
    for seed in (0, 1, 2):
        data, poses = mujoco.MjData(model), draw_poses("flat", seed)
        for name, pose in poses.items():
            half = pose.yaw_rad / 2
            data.joint(name).qpos[:] = [*pose.position_m, np.cos(half), 0, 0, np.sin(half)]
        for _ in range(500):
            mujoco.mj_step(model, data)
        for name, pose in poses.items():
            assert dist(data.body(name).xpos, pose.position_m) < 0.003, name


def test_the_flat_takes_the_robot_in() -> None:
    model = compose(load_robot("butler").mjcf_path, load_world("flat").mjcf_path)

    assert model.body("base").id > 0
    assert model.nu == 18


def test_an_unknown_world_is_refused_with_the_known_ones() -> None:
    with pytest.raises(FileNotFoundError, match="there is flat"):
        draw_poses("moon", 0)
