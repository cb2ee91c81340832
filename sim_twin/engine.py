"""Step the physics: motors in, shaft motion and sensor readings out, the same bits every time."""

import math
from collections.abc import Sequence

import mujoco
import numpy as np

from sim_twin.compose import STEP_S
from sim_twin.errors import ModelMismatch
from sim_twin.probes import MotionProbe, RangeProbe
from sim_twin.shafts import Shaft, Shafts
from sim_twin.truth import Referee

STEP_NS = round(STEP_S * 1e9)
START_NS = 1_000_000_000
"""Simulated time starts at one second: a stamp of zero often means "never"."""


class Engine:
    """Own one model and its state."""

    def __init__(
        self, model: mujoco.MjModel, servos: Sequence[Shaft], drives: Sequence[Shaft]
    ) -> None:
        self.model = model
        self.data = mujoco.MjData(model)
        self.servos = Shafts(model, self.data, servos)
        self.drives = Shafts(model, self.data, drives)
        self.lidar = RangeProbe(model, self.data)
        self.imu = MotionProbe(model, self.data)
        self.referee = Referee(model, self.data)
        self._steps = 0
        self._move_joints_into_range()
        mujoco.mj_forward(model, self.data)

    @property
    def now_ns(self) -> int:
        """Return simulated time in nanoseconds."""
        return START_NS + self._steps * STEP_NS

    def place(self, body: str, x_m: float, y_m: float, z_m: float, yaw_rad: float) -> None:
        """Put a free body somewhere before the simulation runs.

        Raises:
            ModelMismatch: the model has no such body, or it is not free.
        """
        address = self._free_address(body)
        half = yaw_rad / 2.0
        pose = (x_m, y_m, z_m, math.cos(half), 0.0, 0.0, math.sin(half))
        self.data.qpos[address : address + 7] = pose
        mujoco.mj_forward(self.model, self.data)

    def step(self) -> None:
        """Advance the physics by one step."""
        mujoco.mj_step(self.model, self.data)
        self._steps += 1

    def _free_address(self, body: str) -> int:
        found = mujoco.mj_name2id(self.model, mujoco.mjtObj.mjOBJ_BODY, body)
        joint = self.model.body_jntadr[found] if found >= 0 else -1
        if joint < 0 or self.model.jnt_type[joint] != mujoco.mjtJoint.mjJNT_FREE:
            raise ModelMismatch(f"expected a body {body!r} with a free joint, found none")
        return int(self.model.jnt_qposadr[joint])

    def _move_joints_into_range(self) -> None:
        """Start every limited joint inside its range; zero may lie outside."""
        limited = np.flatnonzero(self.model.jnt_limited)
        addresses = self.model.jnt_qposadr[limited]
        low, high = self.model.jnt_range[limited].T
        self.data.qpos[addresses] = np.clip(self.data.qpos[addresses], low, high)
