"""Step the physics: motors in, shaft motion and sensor readings out, the same bits every time."""

import math
from collections.abc import Mapping, Sequence
from functools import cached_property

import mujoco
import numpy as np

from sim_twin.errors import TwinModelMismatch
from sim_twin.physics.compose import STEP_S
from sim_twin.physics.held_things import HeldThings
from sim_twin.physics.probes import MotionProbe, RangeProbe
from sim_twin.physics.shafts import Shaft, Shafts
from sim_twin.physics.truth import Referee

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
        self.referee = Referee(model, self.data)
        self._held_things = HeldThings(model, self.data)
        self.now_ns = START_NS
        """Simulated time in nanoseconds."""
        self._move_joints_into_range()
        mujoco.mj_forward(model, self.data)

    @cached_property
    def lidar(self) -> RangeProbe:
        """Return what a lidar at the model's site would measure."""
        return RangeProbe(self.model, self.data)

    @cached_property
    def imu(self) -> MotionProbe:
        """Return what an IMU at the model's site would feel."""
        return MotionProbe(self.model, self.data)

    @cached_property
    def brought(self) -> tuple[str, ...]:
        """Return the names of the bodies that are where somebody puts them (mocap)."""
        model = self.model
        return tuple(model.body(i).name for i in range(model.nbody) if model.body_mocapid[i] >= 0)

    def place(self, body: str, x_m: float, y_m: float, z_m: float, yaw_rad: float) -> None:
        """Put a body that is free, or only where it is put (mocap), somewhere, at rest.

        Raises:
            ModelMismatch: the model has no such body, or it is neither.
        """
        half = yaw_rad / 2.0
        pose = (x_m, y_m, z_m, math.cos(half), 0.0, 0.0, math.sin(half))
        if body in self.brought:
            index = int(self.model.body(body).mocapid[0])
            self.data.mocap_pos[index], self.data.mocap_quat[index] = pose[:3], pose[3:]
        else:
            joint = self._free_joint(body)
            place, speed = self.model.jnt_qposadr[joint], self.model.jnt_dofadr[joint]
            self.data.qpos[place : place + 7] = pose
            self.data.qvel[speed : speed + 6] = 0.0
        mujoco.mj_forward(self.model, self.data)

    def move(self, body: str, x_m: float, y_m: float, yaw_rad: float) -> None:
        """Move a body that is where somebody puts it along the floor, for the next step."""
        index, half = int(self.model.body(body).mocapid[0]), yaw_rad / 2.0
        self.data.mocap_pos[index, :2] = x_m, y_m
        self.data.mocap_quat[index] = math.cos(half), 0.0, 0.0, math.sin(half)

    def pose(self, joints: Mapping[str, float]) -> None:
        """Set joints, and those coupled to them, before the simulation runs.

        Raises:
            ModelMismatch: the model has no such joint.
        """
        for name, value in joints.items():
            joint = mujoco.mj_name2id(self.model, mujoco.mjtObj.mjOBJ_JOINT, name)
            if joint < 0:
                raise TwinModelMismatch(f"expected a joint {name!r}, the model has none")
            self.data.qpos[self.model.jnt_qposadr[joint]] = value
        self._follow_couplings()
        mujoco.mj_forward(self.model, self.data)

    def step(self) -> None:
        """Advance the physics by one step."""
        mujoco.mj_step(self.model, self.data)
        self._held_things.step()
        self.now_ns += STEP_NS

    def _free_joint(self, body: str) -> int:
        found = mujoco.mj_name2id(self.model, mujoco.mjtObj.mjOBJ_BODY, body)
        joint = self.model.body_jntadr[found] if found >= 0 else -1
        if joint < 0 or self.model.jnt_type[joint] != mujoco.mjtJoint.mjJNT_FREE:
            raise TwinModelMismatch(f"expected a body {body!r} with a free joint, found none")
        return int(joint)

    def _follow_couplings(self) -> None:
        """Move mimic joints to where their equality constraint wants them."""
        coupled = self.model.eq_type == mujoco.mjtEq.mjEQ_JOINT.value
        for row in np.flatnonzero(coupled):
            follower = self.model.jnt_qposadr[self.model.eq_obj1id[row]]
            leader = self.model.jnt_qposadr[self.model.eq_obj2id[row]]
            value = np.polynomial.Polynomial(self.model.eq_data[row, :5])(self.data.qpos[leader])
            self.data.qpos[follower] = value

    def _move_joints_into_range(self) -> None:
        """Start every limited joint inside its range; zero may lie outside."""
        limited = np.flatnonzero(self.model.jnt_limited)
        addresses = self.model.jnt_qposadr[limited]
        low, high = self.model.jnt_range[limited].T
        self.data.qpos[addresses] = np.clip(self.data.qpos[addresses], low, high)
