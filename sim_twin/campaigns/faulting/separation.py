"""Tell how near the robot's base came to what stands fast, as the physics has it."""

import math

import mujoco
import numpy as np
from numpy.typing import NDArray

from sim_twin.physics.compose import ROBOT_ROOT

_FAR_M = 0.5


class Separation:
    """Keep the least distance between the base's hull and walls and furniture; call `look`."""

    def __init__(self, model: mujoco.MjModel, data: mujoco.MjData) -> None:
        self._model = model
        self._data = data
        solid = (model.geom_contype != 0) | (model.geom_conaffinity != 0)
        flat = model.geom_type == mujoco.mjtGeom.mjGEOM_PLANE.value
        root = model.body(ROBOT_ROOT).id
        self._hull = np.flatnonzero(solid & (model.geom_bodyid == root))
        self._fixed = np.flatnonzero(solid & ~flat & (model.body_weldid[model.geom_bodyid] == 0))
        self.least_m = math.inf

    def look(self) -> None:
        """Measure once; what is half a metre off or farther is not told."""
        for mine in self._hull:
            for other in self._near(int(mine)):
                gap_m = mujoco.mj_geomDistance(
                    self._model, self._data, int(mine), int(other), _FAR_M, None
                )
                if gap_m < _FAR_M:
                    self.least_m = min(self.least_m, float(gap_m))

    def _near(self, mine: int) -> NDArray[np.intp]:
        """Return the geoms whose bounding spheres are near enough to be worth a measurement."""
        centres, reach_m = self._data.geom_xpos, self._model.geom_rbound
        apart_m = np.linalg.norm(centres[self._fixed] - centres[mine], axis=1)
        near: NDArray[np.intp] = self._fixed[
            apart_m - reach_m[self._fixed] - reach_m[mine] < _FAR_M
        ]
        return near
