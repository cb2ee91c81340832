"""The robot standing in the twin's flat, without physics: what its sensors would show.

`StillFlat` is the flat to pose and to look at; `Rig` steps perception's node in it.
"""

import math
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import can
import mujoco
import numpy as np
import pytest
from numpy.typing import NDArray

from drivers.camera.protocol import BYTES_PER_PIXEL, CRC, HEADER_BYTES, Intrinsics
from platforms import Profile, load_profile
from sim_twin.device import WireDevice
from sim_twin.faults.line_tamper import LineTamper
from sim_twin.physics.compose import compose
from sim_twin.physics.probes import RangeProbe
from sim_twin.pictures.head_camera import HeadCamera
from sim_twin.ports.lines import MemoryLine
from sim_twin.sensors.camera import CameraDevice
from sim_twin.sensors.imu import ImuDevice, ImuTruth
from sim_twin.sensors.lidar import LidarDevice
from sim_twin.worlds.placement import draw_poses, load_world
from vla_deploy.ipc import Sample, SharedSpace
from vla_deploy.perception.geometry.body_mask import BodyMask
from vla_deploy.perception.geometry.cloud import Cloud, make_cloud
from vla_deploy.perception.geometry.geometry_grid import GeometryGrid, geometry_grid
from vla_deploy.perception.node import PerceptionNode
from vla_deploy.robots import load_robot
from vla_deploy.robots.floor_pose import Pose2D
from vla_deploy.robots.kinematics.model import RobotModel
from vla_deploy.runtime.node import NodeContext

Rgb = NDArray[np.uint8]
Depth = NDArray[np.float32]

STEP_NS = 10_000_000
NODE_PERIOD_NS = 20_000_000
VIEW = Pose2D(2.2, 2.05, -math.pi / 2)
HIDDEN_GROUP = 5


class StillFlat:
    """Pose robot and objects at will, then look."""

    def __init__(self) -> None:
        self.robot = load_robot("butler")
        self.kinematics = RobotModel(self.robot)
        self.body_mask = BodyMask(self.kinematics)
        self.world = load_world("flat")
        self.model = compose(self.robot.mjcf_path, self.world.mjcf_path)
        self.data = mujoco.MjData(self.model)
        self.camera = HeadCamera(self.model, self.data, self.robot.camera, seed=0)
        self.lidar = RangeProbe(self.model, self.data)
        self.joints = self.positions()
        self.base = Pose2D(0.0, 0.0, 0.0)

    @property
    def intrinsics(self) -> Intrinsics:
        return self.robot.camera.pinhole

    @property
    def grid(self) -> GeometryGrid:
        return geometry_grid(self.intrinsics)

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
        """Render on the geometry's grid, with a stereo camera's noise, in whole millimetres."""
        rgb, depth = self.camera.render()
        noisy = depth + 0.0012 * depth**2 * random.standard_normal(depth.shape)
        rounded = (np.rint(noisy * 1000.0) / 1000.0).astype(np.float32)
        return self.grid.colours(rgb), self.grid.depth(rounded)

    def cloud(self, seed: int = 0) -> Cloud:
        """Return the points of a noisy view, with the robot's own body masked."""
        rgb, depth = self.noisy_view(np.random.default_rng(seed))
        body = self.body_mask.mask(self.joints, self.grid.camera)
        pose = self.kinematics.camera_pose(self.joints)
        return make_cloud(rgb, depth, self.grid.camera, pose, body)

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


class Rig:
    """Step sensors and node; stand in for control by telling the true joints and wheel odometry."""

    def __init__(
        self, flat: StillFlat, run_dir: Path, believed: Pose2D, profile: Profile | None = None
    ) -> None:
        self.now = 1_000_000_000
        self.flat = flat
        self.head_tilt: Callable[[float], float] = lambda _: 0.75
        self.base: Callable[[float], Pose2D] = lambda _: VIEW
        self.arm: dict[str, float] = {}
        self.pressing = ""
        flat.scatter(1)
        self.spoil: Callable[[Rgb, Depth], tuple[Rgb, Depth]] = lambda rgb, depth: (rgb, depth)
        self.devices: dict[str, WireDevice] = {
            "lidar": LidarDevice(flat.lidar.cast, seed=1),
            "imu": ImuDevice(self._feel, seed=1),
            "camera": CameraDevice(self._render, flat.intrinsics, latency_s=0.03, seed=1),
        }
        pixels = flat.intrinsics.width * flat.intrinsics.height
        frame_bytes = HEADER_BYTES + pixels * BYTES_PER_PIXEL + CRC.size
        self.camera_wire = LineTamper(
            self.devices["camera"], self.now_ns, frame_bytes, tells_time=False
        )
        wires = {**self.devices, "camera": self.camera_wire}
        self.lines = {name: MemoryLine(device, self) for name, device in wires.items()}
        self.space = SharedSpace(run_dir / "ipc", self)
        self._joint_state = self.space.cell_writer("joint_state")
        self._base_state = self.space.cell_writer("base_state")
        context = NodeContext(
            run_dir=run_dir, robot="butler", profile="desktop", devices_dir=None, clock=self
        )
        home = flat.robot.home
        start = replace(
            home.places[home.start].pose,
            x_m=believed.x_m,
            y_m=believed.y_m,
            yaw_rad=believed.yaw_rad,
        )
        places = {**home.places, home.start: replace(home.places[home.start], pose=start)}
        robot = replace(
            flat.robot, parts=replace(flat.robot.parts, home=replace(home, places=places))
        )
        self.profile = load_profile("desktop") if profile is None else profile
        self.node = PerceptionNode(context, robot, self.profile, self)
        self.node.start()

    def now_ns(self) -> int:
        return self.now

    def sleep_until(self, deadline_ns: int) -> None:
        raise AssertionError("perception never sleeps")

    def serial(self, name: str) -> MemoryLine:
        return self.lines[name]

    def video(self, name: str) -> MemoryLine:
        return self.lines[name]

    def stream(self, name: str) -> MemoryLine:
        return self.lines[name]

    def can(self, name: str) -> can.BusABC:
        raise AssertionError("perception has no business on the CAN bus")

    def run_for(self, seconds: float) -> None:
        end_ns = self.now + round(seconds * 1e9)
        while self.now < end_ns:
            self.now += STEP_NS
            t = self.now / 1e9
            self.flat.stand(self.base(t), head_tilt=self.head_tilt(t), **self.arm)
            for device in self.devices.values():
                device.step(self.now)
            if self.now % NODE_PERIOD_NS == 0:
                self._tell()
                self.node.step()

    def sample(self, name: str) -> Sample:
        sample = self.space.cell_reader(name).latest()
        assert sample is not None, f"{name} was never published"
        return sample

    def cell(self, name: str) -> Any:
        return self.sample(name).data

    def scene(self) -> dict[str, Any]:
        return self.sample("scene").document()

    def known(self) -> dict[str, dict[str, Any]]:
        return {thing["id"]: thing for thing in self.scene()["objects"]}

    def pose_error(self) -> tuple[float, float]:
        data = self.cell("pose")
        off = Pose2D(data["x_m"], data["y_m"], data["yaw_rad"]).relative_to(self.flat.base)
        return math.hypot(off.x_m, off.y_m), abs(off.yaw_rad)

    def _render(self) -> tuple[Rgb, Depth]:
        return self.spoil(*self.flat.camera.render())

    def _feel(self) -> ImuTruth:
        return ImuTruth(
            yaw_rad=self.flat.base.yaw_rad,
            pitch_rad=0.0,
            roll_rad=0.0,
            acceleration_m_s2=(0.0, 0.0, 9.81),
        )

    def _tell(self) -> None:
        count = len(self.flat.joints)
        zeros = np.zeros(count)
        presses = np.array([name == self.pressing for name in self.flat.robot.joint_names])
        self._joint_state.put(
            joint_count=count,
            position=self.flat.joints,
            velocity=zeros,
            setpoint=self.flat.joints - 0.01 * presses,
            effort_ratio=-0.25 * presses,
            age_s=zeros,
            error=zeros,
            torque_enabled=np.ones(count),
        )
        moved = self.flat.base.relative_to(VIEW)
        self._base_state.put(
            x_m=1.05 * moved.x_m,
            y_m=1.05 * moved.y_m,
            yaw_rad=0.95 * moved.yaw_rad,
            v_m_s=0.0,
            w_rad_s=0.0,
            enabled=1,
        )


@pytest.fixture(scope="module")
def flat() -> Iterator[StillFlat]:
    still = StillFlat()
    yield still
    still.camera.close()


@pytest.fixture
def make_rig(flat: StillFlat, tmp_path: Path) -> Iterator[Callable[..., Rig]]:
    rigs = []

    def make(believed: Pose2D = VIEW, profile: Profile | None = None) -> Rig:
        rigs.append(Rig(flat, tmp_path, believed, profile))
        return rigs[-1]

    yield make
    for rig in rigs:
        rig.node.stop()
