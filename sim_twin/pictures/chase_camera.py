"""Follow the robot with a camera that keeps its hands in view."""

import mujoco
import numpy as np
from numpy.typing import NDArray

from sim_twin.physics.compose import ROBOT_ROOT

DISTANCE_M = 2.3
ANGLE_COST_DEG = {125.0: 0.0, -125.0: 0.0, 45.0: 15.0, -45.0: 15.0}
"""Viewing directions relative to the robot's own, best first: front right and left, then behind."""
ELEVATIONS_DEG = (28.0, 34.0, 40.0, 46.0, 52.0, 58.0, 64.0, 70.0)
WATCHED_M = ((0.0, 0.45), (0.0, 0.95), (0.45, 0.62))
"""Points to keep in sight: how far ahead of the base, how high; the last is where hands work."""
MOUNTED_SCALE = 0.36
"""Of these lengths, for an arm that is mounted on a table."""
HIDDEN_COST_DEG = 40.0
SWITCH_COST_DEG = 10.0
FOLLOW_SHARE = 0.12
_FURNITURE_GROUPS = np.array([1, 0, 0, 0, 0, 0], np.uint8)

Point = NDArray[np.float64]


class ChaseCamera:
    """Watch from the front or, where that is hidden, from behind; low, and without haste."""

    def __init__(self, model: mujoco.MjModel, data: mujoco.MjData) -> None:
        self.view = mujoco.MjvCamera()
        self.view.type = mujoco.mjtCamera.mjCAMERA_FREE.value
        self._model = model
        self._data = data
        self._root = model.body(ROBOT_ROOT).id
        self._scale = 1.0 if model.body_dofnum[self._root] else MOUNTED_SCALE
        self.view.distance = self._scale * DISTANCE_M
        self._angle_deg = next(iter(ANGLE_COST_DEG))
        self._move(share=1.0)

    def follow(self) -> mujoco.MjvCamera:
        """Move towards the robot as it is now and return the view."""
        self._move(FOLLOW_SHARE)
        return self.view

    def _move(self, share: float) -> None:
        target = self._point(0.35, 0.6)
        self._angle_deg, elevation_deg = self._best_place(target)
        turn = (self._azimuth_deg(self._angle_deg) - self.view.azimuth + 180.0) % 360.0 - 180.0
        self.view.lookat[:] += share * (target - self.view.lookat)
        self.view.azimuth += share * turn
        self.view.elevation += share * (-elevation_deg - self.view.elevation)

    def _best_place(self, target: Point) -> tuple[float, float]:
        """Return angle and elevation that hide least, look from lowest and change least."""
        places = [(angle, rise) for angle in ANGLE_COST_DEG for rise in ELEVATIONS_DEG]
        return min(places, key=lambda place: self._cost_deg(target, *place))

    def _cost_deg(self, target: Point, angle_deg: float, elevation_deg: float) -> float:
        azimuth, elevation = np.radians([self._azimuth_deg(angle_deg), elevation_deg])
        level = np.cos(elevation)
        back = np.array([-level * np.cos(azimuth), -level * np.sin(azimuth), np.sin(elevation)])
        eye = target + self.view.distance * back
        hidden = sum(self._is_hidden(self._point(*watched), eye) for watched in WATCHED_M)
        switch = SWITCH_COST_DEG * (angle_deg != self._angle_deg)
        return elevation_deg + HIDDEN_COST_DEG * hidden + ANGLE_COST_DEG[angle_deg] + switch

    def _is_hidden(self, point: Point, eye: Point) -> bool:
        hit = mujoco.mj_ray(
            self._model, self._data, point, eye - point, _FURNITURE_GROUPS, True, -1, None, None
        )
        return bool(0.0 <= hit <= 1.0)

    def _point(self, ahead_m: float, height_m: float) -> Point:
        matrix = self._data.xmat[self._root]
        ahead = np.array([matrix[0], matrix[3], 0.0])
        offset_m = self._scale * (ahead_m * ahead + [0.0, 0.0, height_m])
        point: Point = self._data.xpos[self._root] + offset_m
        return point

    def _azimuth_deg(self, angle_deg: float) -> float:
        matrix = self._data.xmat[self._root]
        return float(np.degrees(np.arctan2(matrix[3], matrix[0]))) + angle_deg
