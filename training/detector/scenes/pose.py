"""Pose the robot and its camera for an image, and sometimes put a thing into its hand."""

import math
from typing import Any

import mujoco
import numpy as np

from training.detector.classes import SMALL
from training.detector.scenes.layout import CAMERA_HEIGHT_M, ImageContents
from training.detector.scenes.parts import Random, between
from training.detector.scenes.scene_model import ROBOT_PREFIX, SceneStage

CAMERA = f"{ROBOT_PREFIX}head_camera"
GRIPS = (f"{ROBOT_PREFIX}left_grip", f"{ROBOT_PREFIX}right_grip")
ARMS_DOWN_CHANCE = 0.55
HELD_CHANCE = 0.08
HEIGHT_SPREAD_M = (-0.3, 0.12)


def pose_robot(stage: SceneStage, layout: ImageContents, random: Random) -> None:
    """Stand the robot at its viewpoint, look at the target roughly, move arms and camera a bit."""
    model, data, view = stage.model, stage.data, layout.view
    lift = between(random, *HEIGHT_SPREAD_M) if random.random() < 0.6 else 0.0
    stand = (view.x_m, view.y_m, lift, *_yaw(view.yaw_rad))
    _set(model, data, f"{ROBOT_PREFIX}base", stand)
    dx, dy = view.target[0] - view.x_m, view.target[1] - view.y_m
    pan = math.remainder(math.atan2(dy, dx) - view.yaw_rad, 2 * math.pi) + between(
        random, -0.3, 0.3
    )
    down = math.atan2(CAMERA_HEIGHT_M + lift - view.target[2], math.hypot(dx, dy))
    _turn(model, data, f"{ROBOT_PREFIX}head_pan", pan)
    _turn(model, data, f"{ROBOT_PREFIX}head_tilt", down + between(random, -0.3, 0.25))
    _move_arms(model, data, random)
    camera = model.camera(CAMERA).id
    model.cam_pos[camera] += random.uniform(-0.01, 0.01, 3)
    model.cam_quat[camera] += random.normal(0.0, 0.015, 4)
    model.cam_quat[camera] /= np.linalg.norm(model.cam_quat[camera])
    model.cam_fovy[camera] += between(random, -2.0, 2.0)
    mujoco.mj_kinematics(model, data)
    if random.random() < HELD_CHANCE:
        _hold(stage, layout, random)
    mujoco.mj_kinematics(model, data)
    mujoco.mj_comPos(model, data)
    mujoco.mj_camlight(model, data)


def _yaw(yaw_rad: float) -> tuple[float, float, float, float]:
    return (math.cos(yaw_rad / 2), 0.0, 0.0, math.sin(yaw_rad / 2))


def _set(model: Any, data: Any, body: str, pose: tuple[float, ...]) -> None:
    address = model.jnt_qposadr[model.body_jntadr[model.body(body).id]]
    data.qpos[address : address + 7] = pose


def _turn(model: Any, data: Any, joint: str, value: float) -> None:
    number = model.joint(joint).id
    low, high = model.jnt_range[number]
    data.qpos[model.jnt_qposadr[number]] = min(high, max(low, value))


def _move_arms(model: Any, data: Any, random: Random) -> None:
    for side in ("left", "right"):
        free = random.random() > ARMS_DOWN_CHANCE
        for number in range(model.njnt):
            name = model.joint(number).name
            if name.startswith(f"{ROBOT_PREFIX}{side}") and "wheel" not in name:
                low, high = model.jnt_range[number]
                reach = between(random, 0.0, 1.0) if free else 0.5 * between(random, 0.0, 0.2)
                rest = min(high, max(low, 0.0))
                end = low if random.random() < 0.5 else high
                _turn(model, data, name, rest + reach * 0.75 * (end - rest))


def _hold(stage: SceneStage, layout: ImageContents, random: Random) -> None:
    pool = [p for p in stage.props if p.thing.class_name in SMALL and p not in layout.shown]
    small = [prop for prop in pool if prop.thing.radius_m < 0.06]
    if not small:
        return
    prop = small[int(random.integers(len(small)))]
    site = stage.data.site(GRIPS[int(random.integers(len(GRIPS)))])
    quat = np.empty(4)
    mujoco.mju_mat2Quat(quat, site.xmat)
    x, y, z = site.xpos
    stage.show(prop, (x, y, z), (quat[0], quat[1], quat[2], quat[3]))
    layout.shown.append(prop)
