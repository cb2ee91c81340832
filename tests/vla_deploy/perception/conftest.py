"""The robot standing in the twin's flat, without physics: what its camera and lidar would show."""

import math
from collections.abc import Iterator

import mujoco
import numpy as np
import pytest
from numpy.typing import NDArray

from drivers.camera.protocol import Intrinsics
from sim_twin.compose import compose
from sim_twin.head_camera import HeadCamera
from sim_twin.probes import RangeProbe
from sim_twin.worlds.placement import draw_poses, load_world
from vla_deploy.navigation.pose import Pose2D
from vla_deploy.robots import load_robot
from vla_deploy.robots.model import RobotModel

HIDDEN_GROUP = 5


class StillFlat:
    """Pose robot and objects at will, then look."""

    def __init__(self) -> None:
        self.robot = load_robot("butler")
        self.kinematics = RobotModel(self.robot)
        self.world = load_world("flat")
        self.model = compose(self.robot.mjcf_path, self.world.mjcf_path)
        self.data = mujoco.MjData(self.model)
        self.camera = HeadCamera(self.model, self.data, self.robot.camera, seed=0)
        self.lidar = RangeProbe(self.model, self.data)
        self.joints = self.positions()
        self.base = Pose2D(0.0, 0.0, 0.0)

    @property
    def intrinsics(self) -> Intrinsics:
        camera = self.robot.camera
        return Intrinsics(
            width=camera.width,
            height=camera.height,
            fx=camera.focal_px,
            fy=camera.focal_px,
            cx=(camera.width - 1) / 2,
            cy=(camera.height - 1) / 2,
        )

    def positions(self, **joints: float) -> NDArray[np.float64]:
        """Return the joint array of the tucked pose with some joints changed."""
        named = {**self.robot.poses["tuck"], **self.robot.poses["look_down"], **joints}
        return np.array([named.get(name, 0.02) for name in self.robot.joint_names])

    def stand(self, base: Pose2D, **joints: float) -> None:
        """Put the robot somewhere."""
        self.base, self.joints = base, self.positions(**joints)
        for name, value in zip(self.robot.joint_names, self.joints, strict=True):
            self._set(name, value)
            if name.endswith("_gripper"):
                self._set(f"{name}_mimic", value)
        self._put("base", (base.x_m, base.y_m, 0.0), base.yaw_rad)
        mujoco.mj_forward(self.model, self.data)

    def stand_at_viewpoint(self, place: str, index: int = 0, **joints: float) -> None:
        """Put the robot where the robot file says that a place is searched from."""
        view = self.robot.places[place].viewpoints[index]
        self.stand(Pose2D(view.x_m, view.y_m, view.yaw_rad), **joints)

    def scatter(self, seed: int) -> None:
        """Place the objects as the twin does for a seed."""
        for name, pose in draw_poses("flat", seed).items():
            self._put(name, pose.position_m, pose.yaw_rad)
        mujoco.mj_forward(self.model, self.data)

    def put(self, name: str, position_m: tuple[float, float, float], yaw_rad: float = 0.0) -> None:
        """Place one object by its body's origin."""
        self._put(name, position_m, yaw_rad)
        mujoco.mj_forward(self.model, self.data)

    def truth(self, name: str) -> NDArray[np.float64]:
        """Return where an object's body is."""
        return np.array(self.data.body(name).xpos)

    def noisy_view(
        self, random: np.random.Generator
    ) -> tuple[NDArray[np.uint8], NDArray[np.float32]]:
        """Render with the depth noise of a stereo camera, in whole millimetres."""
        rgb, depth = self.camera.render()
        noisy = depth + 0.0012 * depth**2 * random.standard_normal(depth.shape)
        return rgb, (np.rint(noisy * 1000.0) / 1000.0).astype(np.float32)

    def view_without_robot(self) -> tuple[NDArray[np.uint8], NDArray[np.float32]]:
        """Render what the camera would see were the robot transparent."""
        model = self.model
        groups = model.geom_group.copy()
        own = model.body_rootid[model.geom_bodyid] == model.body("base").id
        model.geom_group[own] = HIDDEN_GROUP
        view = self.camera.render()
        model.geom_group[:] = groups
        return view

    def _set(self, joint: str, value: float) -> None:
        self.data.qpos[self.model.joint(joint).qposadr[0]] = value

    def _put(self, body: str, position_m: tuple[float, float, float], yaw_rad: float) -> None:
        start = self.model.jnt_qposadr[self.model.body(body).jntadr[0]]
        turn = (math.cos(yaw_rad / 2), 0.0, 0.0, math.sin(yaw_rad / 2))
        self.data.qpos[start : start + 7] = (*position_m, *turn)


@pytest.fixture(scope="module")
def flat() -> Iterator[StillFlat]:
    still = StillFlat()
    yield still
    still.camera.close()
