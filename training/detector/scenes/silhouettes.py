"""Find the box that a thing would fill in the image if nothing hid it."""

from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from training.detector.scenes.drawing import HEIGHT_PX, WIDTH_PX
from training.detector.scenes.pose import CAMERA

NEAREST_M = 0.02
SIDES = 12
Floats = NDArray[np.float64]
_CORNERS = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], float)
_ANGLES = np.linspace(0.0, 2 * np.pi, SIDES, endpoint=False)
_RING = np.column_stack([np.cos(_ANGLES), np.sin(_ANGLES), np.zeros(SIDES)])
_UP = np.array([0.0, 0.0, 1.0])
_ENDS = np.concatenate([_RING - _UP, _RING + _UP])
_TILTS = np.radians([-90, -60, -30, 0, 30, 60, 90])
_SPHERE = np.concatenate([np.cos(tilt) * _RING + np.sin(tilt) * _UP for tilt in _TILTS])


def extent(model: Any, data: Any, members: list[int]) -> Floats | None:
    """Return left, top, right, bottom in pixels, beyond the image too, of the geoms together.

    None where they reach behind the camera.
    """
    points = np.concatenate([_points(model, data, geom) for geom in members])
    camera = model.camera(CAMERA).id
    in_view = (points - data.cam_xpos[camera]) @ data.cam_xmat[camera].reshape(3, 3)
    depth = -in_view[:, 2]
    if depth.min() < NEAREST_M:
        return None
    focal = 0.5 * HEIGHT_PX / np.tan(np.radians(model.cam_fovy[camera]) / 2)
    u = WIDTH_PX / 2 + focal * in_view[:, 0] / depth
    v = HEIGHT_PX / 2 - focal * in_view[:, 1] / depth
    return np.array([u.min(), v.min(), u.max(), v.max()])


def _points(model: Any, data: Any, geom: int) -> Floats:
    """Return points on the geom's surface in the world: its bounding box would be up to 1.7 times
    as wide as a turned ball.
    """
    local = _local_points(model, geom)
    return np.asarray(local @ data.geom_xmat[geom].reshape(3, 3).T + data.geom_xpos[geom])


def _local_points(model: Any, geom: int) -> Floats:
    size, kind = model.geom_size[geom], model.geom_type[geom]
    if kind == mujoco.mjtGeom.mjGEOM_MESH.value:
        mesh = model.geom_dataid[geom]
        first = model.mesh_vertadr[mesh]
        return np.asarray(model.mesh_vert[first : first + model.mesh_vertnum[mesh]], float)
    if kind == mujoco.mjtGeom.mjGEOM_SPHERE.value:
        return np.asarray(_SPHERE * size[0])
    if kind == mujoco.mjtGeom.mjGEOM_ELLIPSOID.value:
        return np.asarray(_SPHERE * size)
    if kind == mujoco.mjtGeom.mjGEOM_CYLINDER.value:
        return np.asarray(_ENDS * (size[0], size[0], size[1]))
    if kind == mujoco.mjtGeom.mjGEOM_CAPSULE.value:
        lift = size[1] * _UP
        return np.concatenate([_SPHERE * size[0] - lift, _SPHERE * size[0] + lift])
    return np.asarray(_CORNERS * model.geom_aabb[geom, 3:] + model.geom_aabb[geom, :3])
