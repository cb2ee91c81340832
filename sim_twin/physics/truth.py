"""Tell what really happened in the physics; for tests and the demo's verdict only."""

import math
from collections.abc import Mapping
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from sim_twin.errors import RefereeRefusal
from sim_twin.physics.compose import ROBOT_ROOT

STANDSTILL_RAD_S = 0.02
"""A joint that is slower stands still."""
REST_SPEED_M_S = 0.02
REST_RATE_RAD_S = 0.3
_SCALAR_JOINTS = (mujoco.mjtJoint.mjJNT_HINGE.value, mujoco.mjtJoint.mjJNT_SLIDE.value)


def fastest_joint(truth: Mapping[str, Any]) -> tuple[str, float]:
    """Return the name and the speed of the joint that moves fastest."""
    speeds = {name: abs(float(joint["velocity"])) for name, joint in truth["joints"].items()}
    return max(speeds.items(), key=lambda item: item[1])


class Referee:
    """Answer questions about a model's state without changing it."""

    def __init__(self, model: mujoco.MjModel, data: mujoco.MjData) -> None:
        self._model = model
        self._data = data
        root = model.body(ROBOT_ROOT).id
        self._root = root
        self._root_of = model.body_rootid
        self._objects = _free_bodies(model, without=root)
        self._joints = {
            model.joint(i).name: i
            for i in range(model.njnt)
            if int(model.jnt_type[i]) in _SCALAR_JOINTS
            and model.body_rootid[model.jnt_bodyid[i]] == root
        }

    def truth(self) -> dict[str, Any]:
        """Return the poses and speeds of robot, joints and objects."""
        return {
            "sim_s": float(self._data.time),
            "robot": self._robot(),
            "joints": {name: self._joint(index) for name, index in self._joints.items()},
            "objects": {name: self._object(body) for name, body in self._objects.items()},
            "held": [name for name, body in self._objects.items() if self._is_held(body)],
        }

    def inside(self, name: str, container: str) -> dict[str, Any]:
        """Return whether an object rests inside a container, and how far from its middle.

        Raises:
            RefereeRefusal: the world has no such object or container.
        """
        body, holder = self._body(name), self._body(container)
        low, high = self._inner_volume(holder)
        centre = self._in_frame(holder, self._data.xipos[body])
        within = bool(np.all(centre > low) and np.all(centre < high))
        touched = self._touches_robot(body)
        resting = self._is_resting(body)
        middle = (low + high) / 2.0
        return {
            "inside": within and resting and not touched,
            "within": within,
            "resting": resting,
            "touched_by_robot": touched,
            "placement_error_m": float(np.hypot(*(centre - middle)[:2])),
        }

    def touches_robot(self, name: str) -> bool:
        """Return whether a part of the robot touches an object.

        Raises:
            RefereeRefusal: the world has no such object.
        """
        return self._touches_robot(self._body(name))

    def _robot(self) -> dict[str, float]:
        x_m, y_m, z_m = self._data.xpos[self._root]
        matrix = self._data.xmat[self._root]
        return {
            "x_m": float(x_m),
            "y_m": float(y_m),
            "z_m": float(z_m),
            "yaw_rad": math.atan2(matrix[3], matrix[0]),
        }

    def _joint(self, index: int) -> dict[str, float]:
        return {
            "position": float(self._data.qpos[self._model.jnt_qposadr[index]]),
            "velocity": float(self._data.qvel[self._model.jnt_dofadr[index]]),
        }

    def _object(self, body: int) -> dict[str, Any]:
        velocity = self._velocity(body)
        return {
            "position_m": self._data.xipos[body].tolist(),
            "quaternion_wxyz": self._data.xquat[body].tolist(),
            "speed_m_s": float(np.linalg.norm(velocity[3:])),
        }

    def _velocity(self, body: int) -> NDArray[np.float64]:
        """Return angular, then linear velocity at the centre of mass."""
        velocity = np.zeros(6)
        kind = mujoco.mjtObj.mjOBJ_BODY.value
        mujoco.mj_objectVelocity(self._model, self._data, kind, body, velocity, 0)
        return velocity

    def _is_resting(self, body: int) -> bool:
        velocity = self._velocity(body)
        turning, moving = np.linalg.norm(velocity[:3]), np.linalg.norm(velocity[3:])
        return bool(moving < REST_SPEED_M_S and turning < REST_RATE_RAD_S)

    def _partners(self, body: int) -> set[int]:
        """Return the root bodies in contact with a body."""
        geoms = self._data.contact.geom[: self._data.ncon]
        bodies = self._model.geom_bodyid[geoms]
        mine = self._root_of[bodies] == self._root_of[body]
        partners = np.concatenate([bodies[mine[:, 0], 1], bodies[mine[:, 1], 0]])
        return {int(self._root_of[partner]) for partner in partners}

    def _touches_robot(self, body: int) -> bool:
        return self._root in self._partners(body)

    def _is_held(self, body: int) -> bool:
        return self._partners(body) == {self._root}

    def _inner_volume(self, holder: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return the corners, in the container's frame, of the box around all its parts."""
        low, high = np.full(3, np.inf), np.full(3, -np.inf)
        for geom in np.flatnonzero(self._model.geom_bodyid == holder):
            turn = np.zeros(9)
            mujoco.mju_quat2Mat(turn, self._model.geom_quat[geom])
            box = self._model.geom_aabb[geom]
            centre = self._model.geom_pos[geom] + turn.reshape(3, 3) @ box[:3]
            half = np.abs(turn.reshape(3, 3)) @ box[3:]
            low, high = np.minimum(low, centre - half), np.maximum(high, centre + half)
        return low, high

    def _in_frame(self, body: int, point: NDArray[np.float64]) -> NDArray[np.float64]:
        matrix = self._data.xmat[body].reshape(3, 3)
        local: NDArray[np.float64] = matrix.T @ (point - self._data.xpos[body])
        return local

    def _body(self, name: str) -> int:
        found = mujoco.mj_name2id(self._model, mujoco.mjtObj.mjOBJ_BODY, name)
        if found < 0:
            known = ", ".join(self._objects)
            raise RefereeRefusal(f"the world has no body {name!r}; its objects are {known}")
        return int(found)


def _free_bodies(model: mujoco.MjModel, without: int) -> dict[str, int]:
    free = np.flatnonzero(model.jnt_type == mujoco.mjtJoint.mjJNT_FREE)
    bodies = [int(model.jnt_bodyid[joint]) for joint in free]
    return {model.body(body).name: body for body in bodies if body != without}
