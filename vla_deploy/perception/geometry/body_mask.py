"""Mask the robot's own arms and hands in its camera's image, from the MJCF's shapes."""

from dataclasses import dataclass

import cv2
import numpy as np
import pinocchio
from numpy.typing import NDArray

from drivers.camera.protocol import Intrinsics
from vla_deploy.perception.geometry.lens import project
from vla_deploy.robots import RobotDescription
from vla_deploy.robots.kinematics.mjcf import read_mjcf_names

Array = NDArray[np.float64]

MARGIN_M = 0.01
SPACING_M = 0.03
NEAR_M = 0.05


@dataclass(frozen=True, slots=True)
class _Balls:
    """Hold the balls that fill one shape, in the frame of the joint that carries it."""

    joint: int
    centres: Array
    radius_m: float


class BodyMask:
    """Find which pixels show the robot; shapes that carry the camera are left out."""

    def __init__(self, robot: RobotDescription) -> None:
        path = str(robot.mjcf_path)
        self._model = pinocchio.buildModelFromMJCF(path)
        self._data = self._model.createData()
        self._neutral = pinocchio.neutral(self._model)
        camera = self._model.getFrameId(robot.camera.site)
        self._camera_frame = camera
        self._camera_from_site = pinocchio.SE3(robot.camera.site_from_camera).inverse()
        head = self._model.frames[camera].parentJoint
        mimics = read_mjcf_names(robot.mjcf_path).mimics
        leaders = {**{name: name for name in robot.joint_names}, **mimics}
        joints = {self._model.getJointId(name) for name in leaders}
        shapes = _shapes(self._model, path, joints)
        self._balls = [_fill(shape) for shape in shapes if shape.parentJoint != head]
        index = robot.joint_index
        self._places = [
            (self._model.idx_qs[self._model.getJointId(name)], index[leader])
            for name, leader in leaders.items()
        ]

    def mask(self, positions: Array, camera: Intrinsics) -> NDArray[np.bool_]:
        """Return an image that is true where the robot itself is seen."""
        q = self._neutral.copy()
        for place, joint in self._places:
            q[place] = positions[joint]
        pinocchio.framesForwardKinematics(self._model, self._data, q)
        camera_from_world = self._camera_from_site * self._data.oMf[self._camera_frame].inverse()
        image = np.zeros((camera.height, camera.width), dtype=np.uint8)
        for balls in self._balls:
            pose = camera_from_world * self._data.oMi[balls.joint]
            _paint(
                image, balls.centres @ pose.rotation.T + pose.translation, balls.radius_m, camera
            )
        return image.astype(np.bool_)


def _shapes(
    model: pinocchio.Model, path: str, moved_by: set[int]
) -> list[pinocchio.GeometryObject]:
    """Return every collision shape, and the visual ones of moving parts, which may reach beyond.

    The trunk's visual shapes are left out: so near the camera, balls would cover far too much.
    """
    collision, visual = (
        pinocchio.buildGeomFromMJCF(model, path, kind).geometryObjects
        for kind in (pinocchio.GeometryType.COLLISION, pinocchio.GeometryType.VISUAL)
    )
    return [*collision, *(shape for shape in visual if shape.parentJoint in moved_by)]


def _fill(shape: pinocchio.GeometryObject) -> _Balls:
    """Cover a shape with a row of balls along its longest axis."""
    geometry = shape.geometry
    geometry.computeLocalAABB()
    half = 0.5 * np.ptp(np.vstack((geometry.aabb_local.min_, geometry.aabb_local.max_)), axis=0)
    axis = int(np.argmax(half))
    radius_m = float(np.max(np.delete(half, axis)))
    reach_m = max(0.0, float(half[axis]) - 0.5 * radius_m)
    steps = np.linspace(-reach_m, reach_m, max(2, round(2.0 * reach_m / SPACING_M)))
    local = np.outer(steps, np.eye(3)[axis])
    placement = shape.placement
    centres = local @ placement.rotation.T + placement.translation
    return _Balls(shape.parentJoint, centres, radius_m + MARGIN_M)


def _paint(image: NDArray[np.uint8], centres: Array, radius_m: float, camera: Intrinsics) -> None:
    ahead = centres[centres[:, 2] >= NEAR_M]
    for (u, v), z in zip(project(camera, ahead), ahead[:, 2], strict=True):
        radius_px = max(1, round(camera.fx * radius_m / z))
        cv2.circle(image, (round(u), round(v)), radius_px, 1, cv2.FILLED)
