"""Mask the robot's own arms and hands in its camera's image, from the MJCF's shapes."""

from dataclasses import dataclass

import cv2
import numpy as np
import pinocchio
from numpy.typing import NDArray

from drivers.camera.protocol import Intrinsics
from vla_deploy.perception.geometry.lens import project
from vla_deploy.robots.kinematics.model import RobotModel

Array = NDArray[np.float64]

MARGIN_M = 0.01
SPACING_M = 0.03
NEAR_M = 0.05


@dataclass(frozen=True, slots=True)
class _Balls:
    """Hold the balls that fill one shape, in the frame of its joint, or of the base for None."""

    joint: str | None
    centres: Array
    radius_m: float


class BodyMask:
    """Find which pixels show the robot; shapes that carry the camera are left out.

    Every collision shape counts, and the visual ones of moving parts, which may reach beyond. The
    trunk's visual shapes do not: so near the camera, balls would cover far too much.
    """

    def __init__(self, model: RobotModel) -> None:
        self._model = model
        collision = model.shapes(pinocchio.GeometryType.COLLISION)
        visual = model.shapes(pinocchio.GeometryType.VISUAL)
        shapes = [*collision, *((joint, shape) for joint, shape in visual if joint)]
        self._balls = [_fill(joint, one) for joint, one in shapes if joint != model.camera_joint]

    def mask(self, positions: Array, camera: Intrinsics) -> NDArray[np.bool_]:
        """Return an image that is true where the robot itself is seen."""
        base_from_camera = self._model.camera_pose(positions)
        poses = self._model.joint_poses(positions)
        image = np.zeros((camera.height, camera.width), dtype=np.uint8)
        for balls in self._balls:
            pose = poses[balls.joint] if balls.joint else np.eye(4)
            centres = balls.centres @ pose[:3, :3].T + pose[:3, 3]
            local = (centres - base_from_camera[:3, 3]) @ base_from_camera[:3, :3]
            _paint(image, local, balls.radius_m, camera)
        return image.astype(np.bool_)


def _fill(joint: str | None, shape: pinocchio.GeometryObject) -> _Balls:
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
    return _Balls(joint, centres, radius_m + MARGIN_M)


def _paint(image: NDArray[np.uint8], centres: Array, radius_m: float, camera: Intrinsics) -> None:
    ahead = centres[centres[:, 2] >= NEAR_M]
    for (u, v), z in zip(project(camera, ahead), ahead[:, 2], strict=True):
        radius_px = max(1, round(camera.fx * radius_m / z))
        cv2.circle(image, (round(u), round(v)), radius_px, 1, cv2.FILLED)
