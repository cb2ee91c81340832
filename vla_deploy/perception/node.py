"""Run perception: sensors in; robot pose, scan, attitude, images and the scene out."""

import math

import cv2
import numpy as np
from numpy.typing import NDArray

from drivers import registry
from drivers.camera.base import Camera, RgbdFrame
from drivers.clock import NS_PER_S
from drivers.imu.base import Imu, ImuSample
from drivers.lidar.base import Lidar
from drivers.opener import DeviceOpener
from drivers.reopening import Reopening
from platforms import Profile
from vla_deploy.ipc import BY_NAME, CellReader, CellWriter, FrameWriter, SharedSpace
from vla_deploy.ipc.topics import OBSTACLE_POINTS
from vla_deploy.navigation.grid_map import load_map
from vla_deploy.navigation.localisation import Localiser, Pose2D
from vla_deploy.node import NodeContext
from vla_deploy.perception.body import BodyMask
from vla_deploy.perception.history import JointHistory
from vla_deploy.perception.near_obstacles import NearObstacles
from vla_deploy.perception.scene import Scene
from vla_deploy.robots import RobotDescription
from vla_deploy.robots.description import SerialSensor
from vla_deploy.robots.model import RobotModel, full_positions

Array = NDArray[np.float64]

STALE_JOINTS_NS = NS_PER_S // 10
# Without a new yaw for this long, the turn is taken from the wheels.
FRESH_YAW_NS = NS_PER_S // 25
STALE_SCAN_NS = round(BY_NAME["scan"].deadline_s * NS_PER_S)
# An image is used only where the camera was nearly still before its exposure.
STILL_WINDOW_NS = 60_000_000
MAX_CAMERA_TURN_RAD_S = 0.35
SCENE_PERIOD_NS = NS_PER_S // 2
MILLIMETRE_M = 0.001


class PerceptionNode:
    """See, and know where the robot is, from what its sensors say and nothing else."""

    period_s = 0.02

    def __init__(
        self,
        context: NodeContext,
        robot: RobotDescription,
        profile: Profile,
        devices: DeviceOpener,
    ) -> None:
        """Read the map and the kinematics.

        Raises:
            MapInvalid: the robot file's map cannot be used.
            RobotFileError: the MJCF does not fit the robot file.
        """
        self._clock = context.clock
        self._space = SharedSpace(context.run_dir / "ipc", context.clock)
        self._robot = robot
        self._profile = profile
        self._devices = devices
        self._model = RobotModel(robot)
        self._body = BodyMask(robot)
        self._joints = JointHistory()
        self._scene = Scene()
        self._obstacles = NearObstacles()
        self._localiser = self._make_localiser()
        self._imu_yaw_rad: float | None = None
        self._imu_ns = 0
        self._next_look_ns = 0
        self._next_scene_ns = 0
        self._base_stamp_ns = -1

    def start(self) -> None:
        """Open sensors and topics.

        Raises:
            DriverError: a sensor is missing or busy.
        """
        # OpenCV's own threads would compete with control for the cores and gain nothing here.
        cv2.setNumThreads(1)
        space = self._space
        self._joint_state: CellReader = space.cell_reader("joint_state")
        self._base_state: CellReader = space.cell_reader("base_state")
        self._executor_status: CellReader = space.cell_reader("executor_status")
        self._writers: dict[str, CellWriter] = {
            name: space.cell_writer(name)
            for name in ("imu", "scan", "pose", "scene", "near_obstacles")
        }
        self._images: FrameWriter = space.frame_writer("rgbd")
        self._lidar = Reopening("lidar", self._open_lidar, self._clock)
        self._imu = Reopening("imu", self._open_imu, self._clock)
        self._camera = Reopening("camera", self._open_camera, self._clock)
        for slot in (self._lidar, self._imu, self._camera):
            slot.open()

    def step(self) -> None:
        """Take what the sensors have and publish what follows from it."""
        self._read_joints()
        self._read_imu()
        self._move()
        self._read_scan()
        self._read_camera()
        self._carry_held()
        self._publish_scene()

    def stop(self) -> None:
        """Release every sensor."""
        for slot in (self._lidar, self._imu, self._camera):
            slot.close()
        self._space.close()

    def prepare(self, profile: Profile, model_tier: int) -> Profile:
        """Take the profile as it is: how it sees now has one size."""
        return profile

    def commit(self, prepared: Profile) -> Profile:
        """Change the rates; the camera is opened anew where it is to send at another one."""
        before, self._profile = self._profile, prepared
        if before.camera_rate_hz != prepared.camera_rate_hz:
            self._camera.close()
        return before

    def discard(self, prepared: Profile) -> None:
        """Release nothing: rates are numbers."""

    def _read_joints(self) -> None:
        sample = self._joint_state.latest()
        if sample is not None:
            count = len(self._robot.joint_names)
            positions = np.array(sample.data["position"][:count], dtype=np.float64)
            self._joints.add(sample.stamp_ns, positions)

    def _read_imu(self) -> None:
        none: list[ImuSample] = []
        samples = self._imu.poll(lambda imu: imu.poll(), none)
        if not samples:
            return
        newest = samples[-1]
        self._imu_yaw_rad, self._imu_ns = newest.yaw_rad, newest.stamp_ns
        self._writers["imu"].put(
            yaw_rad=newest.yaw_rad,
            pitch_rad=newest.pitch_rad,
            roll_rad=newest.roll_rad,
            acceleration_m_s2=newest.acceleration_m_s2,
        )

    def _move(self) -> None:
        """Dead-reckon; without wheel odometry the robot is taken to stand still."""
        sample = self._base_state.latest()
        if sample is not None and sample.stamp_ns != self._base_stamp_ns:
            self._base_stamp_ns = sample.stamp_ns
            data = sample.data
            odometry = Pose2D(float(data["x_m"]), float(data["y_m"]), float(data["yaw_rad"]))
            self._localiser.predict(sample.stamp_ns, odometry, self._fresh_yaw_rad())
        pose = self._localiser.pose
        self._writers["pose"].put(
            x_m=pose.x_m,
            y_m=pose.y_m,
            yaw_rad=pose.yaw_rad,
            match_ratio=self._localiser.match_ratio,
        )

    def _fresh_yaw_rad(self) -> float | None:
        """Return the IMU's yaw unless it is out of date: a frozen one would hide every turn."""
        age_ns = self._clock.now_ns() - self._imu_ns
        return self._imu_yaw_rad if age_ns <= FRESH_YAW_NS else None

    def _read_scan(self) -> None:
        """Publish a scan unless it is out of date already: its reader takes it for the present."""
        scan = self._lidar.poll(lambda lidar: lidar.poll(), None)
        if scan is not None and self._clock.now_ns() - scan.stamp_ns <= STALE_SCAN_NS:
            self._writers["scan"].put(range_m=scan.range_m)
            self._localiser.correct(scan.range_m, scan.beam_stamp_ns)

    def _read_camera(self) -> None:
        frame = self._camera.poll(lambda camera: camera.poll(), None)
        if frame is None or self._clock.now_ns() < self._next_look_ns:
            return
        self._next_look_ns = self._clock.now_ns() + round(
            0.9 * NS_PER_S / self._profile.perception_rate_hz
        )
        self._publish_image(frame)
        positions = self._joints.at(frame.stamp_ns, STALE_JOINTS_NS)
        if positions is None:
            return
        depth_m, camera = frame.depth_m(), self._model.camera_pose(positions)
        pose = self._localiser.pose_at(frame.stamp_ns)
        body = self._body.mask(positions, frame.intrinsics)
        grips = [self._model.site_pose(site, positions)[:3, 3] for site in self._full_hands()]
        self._obstacles.look(depth_m, frame.intrinsics, camera, body, pose, grips, frame.stamp_ns)
        self._publish_obstacles()
        if self._camera_turn(frame.stamp_ns) > MAX_CAMERA_TURN_RAD_S:
            return
        self._scene.look(frame.rgb, depth_m, frame.intrinsics, camera, pose, body, frame.stamp_ns)
        self._next_scene_ns = 0

    def _full_hands(self) -> list[str]:
        """Return the grip sites of the hands that hold something, as the executor tells."""
        sample = self._executor_status.latest()
        holding = {} if sample is None else sample.document().get("holding", {})
        hands = self._robot.hands
        return [hands[name].grip_site for name, held in holding.items() if held and name in hands]

    def _publish_obstacles(self) -> None:
        """Tell what stands around the base; the stamp is that of the present pose."""
        points = self._obstacles.around(self._localiser.pose, self._clock.now_ns())
        padded = np.zeros((3, OBSTACLE_POINTS), dtype=np.float32)
        padded[:, : len(points)] = points.T
        x_m, y_m, z_m = padded
        self._writers["near_obstacles"].put(count=len(points), x_m=x_m, y_m=y_m, z_m=z_m)

    def _carry_held(self) -> None:
        """Let the things that hands hold, as the executor tells, move along with the hands."""
        sample = self._executor_status.latest()
        positions = self._joints.at(self._clock.now_ns(), STALE_JOINTS_NS)
        if sample is None or positions is None:
            return
        told = sample.document().get("holding", {})
        for name, hand in self._robot.hands.items():
            held = told.get(name)
            if not held:
                self._scene.release(name)
                continue
            pose = self._model.site_pose(hand.grip_site, positions)
            grip = (float(pose[0, 3]), float(pose[1, 3]), float(pose[2, 3]))
            self._scene.carry(name, held, grip, self._localiser.pose, self._clock.now_ns())

    def _camera_turn(self, stamp_ns: int) -> float:
        """Return how fast the camera turned, in the map frame, up to a moment."""
        before = self._view_rotation(stamp_ns - STILL_WINDOW_NS)
        turn = before.T @ self._view_rotation(stamp_ns)
        angle_rad = math.acos(min(1.0, max(-1.0, (float(np.trace(turn)) - 1.0) / 2.0)))
        return angle_rad * NS_PER_S / STILL_WINDOW_NS

    def _view_rotation(self, stamp_ns: int) -> Array:
        positions = self._joints.at(stamp_ns, STALE_JOINTS_NS)
        if positions is None:
            return np.eye(3)
        yaw_rad = self._localiser.pose_at(stamp_ns).yaw_rad
        c, s = math.cos(yaw_rad), math.sin(yaw_rad)
        map_from_base = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
        rotation: Array = map_from_base @ self._model.camera_pose(positions)[:3, :3]
        return rotation

    def _publish_image(self, frame: RgbdFrame) -> None:
        depth = frame.depth
        if frame.depth_unit_m != np.float32(MILLIMETRE_M):
            depth = np.rint(frame.depth_m() / MILLIMETRE_M).clip(0, 65_535).astype("<u2")
        self._images.put(
            frame.rgb.tobytes() + depth.tobytes(),
            width=frame.intrinsics.width,
            height=frame.intrinsics.height,
            stamp_ns=frame.stamp_ns,
        )

    def _publish_scene(self) -> None:
        if self._clock.now_ns() >= self._next_scene_ns:
            self._next_scene_ns = self._clock.now_ns() + SCENE_PERIOD_NS
            self._writers["scene"].put_document({**self._scene.document(), "away": self._away()})

    def _away(self) -> dict[str, str]:
        """Return which sensors are away at present, and why: what they told is stale."""
        failures = {
            "lidar": self._lidar.failure,
            "imu": self._imu.failure,
            "camera": self._camera.failure,
        }
        return {name: failure for name, failure in failures.items() if failure}

    def _make_localiser(self) -> Localiser:
        return Localiser(
            self._last_pose(),
            load_map(self._robot.home.map_path),
            self._place(self._robot.lidar),
        )

    def _last_pose(self) -> Pose2D:
        """Return where an earlier instance in this run left off, else the robot file's start."""
        told = self._space.cell_reader("pose").latest()
        if told is not None:
            return Pose2D(*(float(told.data[name]) for name in ("x_m", "y_m", "yaw_rad")))
        start = self._robot.start_pose
        return Pose2D(start.x_m, start.y_m, start.yaw_rad)

    def _place(self, sensor: SerialSensor) -> Pose2D:
        """Return where a sensor sits on the base; beams already count from the robot's front."""
        pose = self._site(sensor.site)
        return Pose2D(float(pose[0, 3]), float(pose[1, 3]), 0.0)

    def _site(self, site: str) -> Array:
        return self._model.site_pose(site, full_positions(self._robot))

    def _open_lidar(self) -> Lidar:
        robot_lidar = self._robot.lidar
        pose = self._site(robot_lidar.site)
        yaw_rad = math.atan2(pose[1, 0], pose[0, 0])
        line = self._devices.serial(robot_lidar.device)
        return registry.open_lidar(robot_lidar.model, line, self._clock, mounting_yaw_rad=yaw_rad)

    def _open_imu(self) -> Imu:
        imu = self._robot.imu
        return registry.open_imu(imu.model, self._devices.serial(imu.device), self._clock)

    def _open_camera(self) -> Camera[RgbdFrame]:
        camera = self._robot.camera
        return registry.open_camera(
            camera.model,
            self._devices.stream(camera.device),
            self._clock,
            rate_hz=self._profile.camera_rate_hz,
        )
