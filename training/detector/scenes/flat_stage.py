"""Compile the flat itself as a stage: its rooms, its own objects, and the pool of things."""

from typing import Any

import mujoco
import numpy as np

from sim_twin.worlds.placement import load_world
from training.detector.classes import IGNORED
from training.detector.scenes.parts import (
    ON_EDGE,
    ON_SIDE,
    UPRIGHT,
    UPSIDE_DOWN,
    Random,
    RestPose,
    SceneThing,
)
from training.detector.scenes.scene_model import Prop, SceneStage, complete
from training.detector.scenes.surfaces import SceneSurface

WORLD = "flat"
STOOL_PLACES = ((5.95, 4.95), (6.65, 4.95))
SHELF_X_M = 0.34
SURFACES = (
    "coffee_table", "side_table", "kitchen_table", "counter_top", "bedside_table", "shoe_rack",
    "sofa_seat", "mattress",
)  # fmt: skip
OWN: dict[str, tuple[float, tuple[RestPose, ...]]] = {
    "box": (0.16, (RestPose(quat=UPRIGHT, height_m=0.0),)),
    "red_cup": (
        0.05,
        (RestPose(quat=UPRIGHT, height_m=0.0475, weight=5), RestPose(quat=ON_SIDE, height_m=0.033)),
    ),
    "blue_ball": (0.025, (RestPose(quat=UPRIGHT, height_m=0.025),)),
    "book": (
        0.08,
        (RestPose(quat=UPRIGHT, height_m=0.02, weight=5), RestPose(quat=ON_EDGE, height_m=0.0325)),
    ),
    "bottle": (
        0.03,
        (RestPose(quat=UPRIGHT, height_m=0.09, weight=4), RestPose(quat=ON_SIDE, height_m=0.03)),
    ),
    "phone": (
        0.07,
        (
            RestPose(quat=UPRIGHT, height_m=0.006, weight=4),
            RestPose(quat=UPSIDE_DOWN, height_m=0.006),
        ),
    ),
    "keys": (0.05, (RestPose(quat=UPRIGHT, height_m=0.008),)),
}
"""Radius in m and ways to rest of the flat's own objects."""


def build_flat(random: Random, split: str) -> SceneStage:
    """Compile the flat with the robot, its own objects and a pool of newly drawn things."""
    world = load_world(WORLD)
    spec = mujoco.MjSpec.from_file(str(world.mjcf_path))
    spec.visual.quality.numstacks = 10
    own_materials = [material.name for material in spec.materials]
    stage = complete(spec, random, split)
    model = stage.model
    stage.props += [_own(model, name, item.class_name) for name, item in world.objects.items()]
    stage.fixed = _fixed(model)
    stage.surfaces = tuple(_surface(model, name) for name in SURFACES)
    stage.own_materials = [model.material(name).id for name in own_materials]
    stage.remember()
    return stage


def _own(model: Any, name: str, class_name: str) -> Prop:
    radius_m, rests = OWN[name]
    body = model.body(name).id
    first, count = int(model.body_geomadr[body]), int(model.body_geomnum[body])
    return Prop(
        thing=SceneThing(class_name=class_name, parts=(), rests=rests, radius_m=radius_m),
        qpos=int(model.jnt_qposadr[model.body_jntadr[body]]),
        geoms=[geom for geom in range(first, first + count) if model.geom_group[geom] <= 1],
        materials={},
    )


def _surface(model: Any, name: str) -> SceneSurface:
    geom = model.geom(name).id
    x, y, z = model.geom_pos[geom]
    a, b, c = model.geom_size[geom]
    return SceneSurface(x_m=x, y_m=y, yaw_rad=0.0, half_x_m=a, half_y_m=b, height_m=z + c)


def _fixed(model: Any) -> list[tuple[str, list[int]]]:
    """Return what belongs to the flat and is a chair, or looks too much like a book to judge."""
    static = np.flatnonzero(model.geom_bodyid == 0)
    at, kind = model.geom_pos[static], model.geom_type[static]
    round_things = kind == mujoco.mjtGeom.mjGEOM_CYLINDER.value
    stools = [
        (
            "chair",
            [int(g) for g in static[round_things & (np.hypot(at[:, 0] - x, at[:, 1] - y) < 0.05)]],
        )
        for x, y in STOOL_PLACES
    ]
    backs = static[(abs(at[:, 0] - SHELF_X_M) < 1e-6) & (kind == mujoco.mjtGeom.mjGEOM_BOX.value)]
    return stools + [(IGNORED, [int(geom)]) for geom in backs]
