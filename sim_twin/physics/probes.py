"""Read what the robot's range and motion sensors would feel, straight from the physics."""

import copy
import math

import mujoco
import numpy as np
from numpy.typing import NDArray

from sim_twin.physics.compose import ROBOT_ROOT
from sim_twin.sensors.imu import ImuTruth

BEAMS = 360
RANGE_CUTOFF_M = 25.0
ACCELEROMETER = "imu_accelerometer"
_WORLD_GROUPS = (0, 1)
_SHOWN_GROUP = np.array([1, 0, 0, 0, 0, 0], np.uint8)
_ENDLESS_M = 1e6
_SLACK_M = 1e-6
_NOWHERE = (0.0, 0.0)
_RADIUS, _REACH = 4, 5
_PLANE = mujoco.mjtGeom.mjGEOM_PLANE.value


class RangeProbe:
    """Cast rays in the base's plane from the lidar; they pass the robot itself by.

    Rays stay in one plane and within a sector, so geoms that both miss are hidden from them: they
    cannot be hit, and MuJoCo would look at each of them for each ray. The same goes for the robot's
    bodies, which the rays' own model has without geoms. `data` must be up to date.
    """

    def __init__(self, model: mujoco.MjModel, data: mujoco.MjData, site: str = "lidar") -> None:
        self._data = data
        self._origin = data.site_xpos[model.site(site).id]
        self._rotation = data.xmat[model.body(ROBOT_ROOT).id].reshape(3, 3)
        self._centres = data.geom_xpos.T
        self._view = copy.copy(model)
        self._hidden = self._view.geom_group
        of_world = np.isin(model.geom_group, _WORLD_GROUPS)
        _empty_bodies(self._view, np.bincount(model.geom_bodyid, of_world, model.nbody) == 0)
        radius_m = np.where(model.geom_type == _PLANE, _ENDLESS_M, model.geom_rbound)
        reach_m = _reach_from_level_plane(model, data, radius_m) + _SLACK_M
        self._geoms = np.ones((6, model.ngeom))
        self._places = self._geoms[:3]
        self._geoms[_RADIUS] = radius_m + _SLACK_M
        self._geoms[_REACH] = np.where(of_world, reach_m, -_ENDLESS_M)
        turn = np.tile(np.radians(np.arange(BEAMS)), 2)
        cos, sin = np.cos(turn), np.sin(turn)
        self._directions = np.stack([cos, sin, np.zeros(2 * BEAMS)], axis=1)
        self._heading = list(zip(cos.tolist(), sin.tolist(), strict=True))
        self._hit = np.empty(BEAMS, np.int32)

    def cast(self, beams: range) -> NDArray[np.float32]:
        """Return the ranges in metres of a run of beams, at most one turn; 0 is no return.

        Beam i looks i degrees counter-clockwise from the front; 360 is the front again.
        """
        count, first = len(beams), beams.start % BEAMS
        self._hide_what_they_miss(first, count)
        ranges_m, geoms = np.empty(count), self._hit[:count]
        rays = self._directions[first : first + count] @ self._rotation.T
        mujoco.mj_multiRay(
            self._view,
            self._data,
            self._origin,
            rays.ravel(),
            _SHOWN_GROUP,
            True,
            -1,
            geoms,
            ranges_m,
            None,
            count,
            RANGE_CUTOFF_M,
        )
        np.maximum(ranges_m, 0.0, out=ranges_m)
        return ranges_m.astype(np.float32)

    def _hide_what_they_miss(self, first: int, count: int) -> None:
        """Hide geoms above or below the plane, to the right of the first or left of the last.

        How far each geom reaches into each of these half-spaces is one product of matrices: a few
        operations on small arrays cost more than what they compute.
        """
        (ax, bx, up_x), (ay, by, up_y), (az, bz, up_z) = self._rotation.tolist()
        x, y, z = self._origin.tolist()
        height, tilt = up_x * x + up_y * y + up_z * z, math.hypot(up_x, up_y)
        sides = [
            (up_x, up_y, up_z, -height, tilt, 1.0),
            (-up_x, -up_y, -up_z, height, tilt, 1.0),
        ]
        for cos, sin in self._inwards(first, count):
            in_x, in_y, in_z = cos * ax + sin * bx, cos * ay + sin * by, cos * az + sin * bz
            sides.append((in_x, in_y, in_z, -(in_x * x + in_y * y + in_z * z), 1.0, 0.0))
        self._places[:] = self._centres
        np.less(np.minimum.reduce(np.dot(sides, self._geoms)), 0.0, self._hidden)

    def _inwards(self, first: int, count: int) -> tuple[tuple[float, float], ...]:
        """Return, in the base's plane, what is at right angles to the first and last beam."""
        if count > BEAMS // 2:
            return _NOWHERE, _NOWHERE
        (cos, sin), (last_cos, last_sin) = self._heading[first], self._heading[first + count - 1]
        return (-sin, cos), (last_sin, -last_cos)


def _empty_bodies(view: mujoco.MjModel, bodies: NDArray[np.bool_]) -> None:
    """Take the geoms from bodies, and the volumes around them, which every ray is tried against."""
    view.body_geomnum[bodies] = 0
    view.body_bvhadr[bodies] = -1


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
