"""Read what the robot's range and motion sensors would feel, straight from the physics."""

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


class RangeProbe:
    """Cast rays in the base's plane from the lidar; they pass the robot itself by."""

    def __init__(self, model: mujoco.MjModel, data: mujoco.MjData, site: str = "lidar") -> None:
        self._model = model
        self._data = data
        self._site = model.site(site).id
        self._base = model.body(ROBOT_ROOT).id
        angles = np.radians(np.arange(BEAMS))
        self._directions = np.stack([np.cos(angles), np.sin(angles), np.zeros(BEAMS)], axis=1)

    def cast(self, beams: NDArray[np.int64]) -> NDArray[np.float32]:
        """Return ranges in metres, beam i at i degrees counter-clockwise; 0 is no return."""
        rotation = self._data.xmat[self._base].reshape(3, 3)
        geoms = np.zeros(beams.size, np.int32)
        ranges_m = np.zeros(beams.size)
        mujoco.mj_multiRay(
            self._model,
            self._data,
            self._data.site_xpos[self._site],
            (self._directions[beams] @ rotation.T).ravel(),
            _WORLD_GROUPS,
            True,
            -1,
            geoms,
            ranges_m,
            None,
            beams.size,
            RANGE_CUTOFF_M,
        )
        hit = (geoms >= 0) & (ranges_m > 0.0)
        return np.where(hit, ranges_m, 0.0).astype(np.float32)


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
