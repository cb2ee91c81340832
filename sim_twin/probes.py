"""Read what the robot's range and motion sensors would feel, straight from the physics."""

import copy
import math

import mujoco
import numpy as np
from numpy.typing import NDArray

from sim_twin.compose import ROBOT_ROOT
from sim_twin.sensors.imu import ImuTruth

BEAMS = 360
RANGE_CUTOFF_M = 25.0
ACCELEROMETER = "imu_accelerometer"
_WORLD_GROUPS = np.array([1, 1, 0, 0, 0, 0], np.uint8)
_HIDDEN_GROUP = 5
_ENDLESS_M = 1e6
_PLANE = mujoco.mjtGeom.mjGEOM_PLANE.value


class RangeProbe:
    """Cast rays in the base's plane from the lidar; they pass the robot itself by.

    Rays stay in one plane, so geoms that the plane misses are hidden from them: they cannot be hit,
    and MuJoCo would look at each of them for each ray. `data` must be up to date.
    """

    def __init__(self, model: mujoco.MjModel, data: mujoco.MjData, site: str = "lidar") -> None:
        self._data = data
        site_id = model.site(site).id
        self._origin = data.site_xpos[site_id]
        self._rotation = data.xmat[model.body(ROBOT_ROOT).id].reshape(3, 3)
        self._centres = data.geom_xpos
        self._view = copy.copy(model)
        self._view_groups = self._view.geom_group
        self._groups = model.geom_group.copy()
        self._radius_m = np.where(model.geom_type == _PLANE, _ENDLESS_M, model.geom_rbound)
        self._reach_m = _reach_from_level_plane(model, data, self._radius_m)
        angles = np.radians(np.arange(BEAMS))
        self._directions = np.stack([np.cos(angles), np.sin(angles), np.zeros(BEAMS)], axis=1)

    def cast(self, beams: NDArray[np.int64]) -> NDArray[np.float32]:
        """Return ranges in metres, beam i at i degrees counter-clockwise; 0 is no return."""
        self._show_what_the_plane_meets()
        geoms = np.empty(beams.size, np.int32)
        ranges_m = np.empty(beams.size)
        mujoco.mj_multiRay(
            self._view,
            self._data,
            self._origin,
            (self._directions[beams] @ self._rotation.T).ravel(),
            _WORLD_GROUPS,
            True,
            -1,
            geoms,
            ranges_m,
            None,
            beams.size,
            RANGE_CUTOFF_M,
        )
        ranges_m[geoms < 0] = 0.0
        return ranges_m.astype(np.float32)

    def _show_what_the_plane_meets(self) -> None:
        normal = self._rotation[:, 2]
        distance_m = self._centres @ normal
        distance_m -= self._origin @ normal
        np.abs(distance_m, out=distance_m)
        distance_m -= math.hypot(normal[0], normal[1]) * self._radius_m
        self._view_groups[:] = np.where(distance_m <= self._reach_m, self._groups, _HIDDEN_GROUP)


def _reach_from_level_plane(
    model: mujoco.MjModel, data: mujoco.MjData, radius_m: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return how far from its centre each geom may meet a level plane; known where it is fixed."""
    upwards = np.abs(data.geom_xmat.reshape(-1, 3, 3)[:, 2])
    half_height_m = (upwards * model.geom_aabb[:, 3:]).sum(axis=1)
    fixed = model.body_weldid[model.geom_bodyid] == 0
    return np.where(fixed, np.minimum(half_height_m, radius_m), radius_m)


class MotionProbe:
    """Read attitude and specific force at the IMU's site."""

    def __init__(self, model: mujoco.MjModel, data: mujoco.MjData, site: str = "imu") -> None:
        address = int(model.sensor(ACCELEROMETER).adr[0])
        self._matrix = data.site_xmat[model.site(site).id]
        self._force = data.sensordata[address : address + 3]

    def read(self) -> ImuTruth:
        """Return yaw, pitch, roll and acceleration with gravity, in the site's frame."""
        matrix, force = self._matrix.tolist(), self._force.tolist()
        return ImuTruth(
            yaw_rad=math.atan2(matrix[3], matrix[0]),
            pitch_rad=math.asin(max(-1.0, min(1.0, -matrix[6]))),
            roll_rad=math.atan2(matrix[7], matrix[8]),
            acceleration_m_s2=(force[0], force[1], force[2]),
        )
