"""Run perception: sensors in; robot pose, scan, attitude, images and the scene out."""

from concurrent.futures import Executor
from dataclasses import dataclass

import cv2
import numpy as np

from drivers.camera.base import RgbdFrame
from drivers.clock import NS_PER_S
from drivers.opener import DeviceOpener
from platforms import Profile
from vla_deploy.inference.roles import ModelShelf
from vla_deploy.ipc import BY_NAME, CellWriter, FrameWriter, SharedSpace, topics
from vla_deploy.ipc.topics import OBSTACLE_POINTS
from vla_deploy.perception.geometry.plane_depth import PlaneDepth
from vla_deploy.perception.images.detector_worker import (
    DetectorWorker,
    LoadedDetector,
    load_detector,
)
from vla_deploy.perception.images.image_pipeline import ImagePipeline
from vla_deploy.perception.mounted_pose import MountedPose
from vla_deploy.perception.objects.body_state import BodyState
from vla_deploy.perception.pose_tracker import PoseTracker
from vla_deploy.perception.sensors import Sensors
from vla_deploy.perception.wheel_pose import WheelPose
from vla_deploy.robots import RobotDescription
from vla_deploy.robots.kinematics.model import RobotModel
from vla_deploy.runtime.executors import InlineExecutor
from vla_deploy.runtime.node import NodeContext
from vla_deploy.world.surfaces import furniture_points

STALE_SCAN_NS = round(BY_NAME["scan"].deadline_s * NS_PER_S)
SCENE_PERIOD_NS = NS_PER_S // 2
MILLIMETRE_M = 0.001
# Of the period between images: one that arrives a little early is used, too.
EARLY_RATIO = 0.9


@dataclass(frozen=True, slots=True, kw_only=True)
class PerceptionSetup:
    """Hold what a profile sets for perception: its rates and its detector."""

    profile: Profile
    loaded: LoadedDetector


class PerceptionNode:
    """Publish scene, obstacles and pose, from the robot's sensors and nothing else.

    The detector runs in `executor`, outside the steps; without one, within them.
    """

    period_s = 0.02

    def __init__(
        self,
        context: NodeContext,
        robot: RobotDescription,
        profile: Profile,
        devices: DeviceOpener,
        executor: Executor | None = None,
    ) -> None:
        """Read the map and the kinematics.

        Raises:
            MapInvalid: the robot file's map cannot be used.
            RobotFileError: the MJCF does not fit the robot file.
        """
        self._clock = context.clock
        self._space = SharedSpace(context.run_dir / "ipc", context.clock)
        self._profile = profile
        self._shelf = ModelShelf.of_run(context.run_dir, context.clock)
        model = RobotModel(robot)
        rate_hz = profile.camera_rate_hz
        self._sensors = Sensors(robot, model, devices, context.clock, rate_hz)
        self._body = BodyState(robot, model)
        self._looks_around = robot.finds_its_way
        self._pose_tracker = _pose_of(robot, model, self._space)
        executor = InlineExecutor() if executor is None else executor
        self._worker = DetectorWorker(executor, context.clock)
        furniture = furniture_points(robot.places)
        # Without a map the floor is where things lie, and the robot takes them from there.
        localiser, floor_m = self._pose_tracker.localiser, 0.0 if self._looks_around else None
        has_depth = robot.camera.has_depth
        plane_depth = None if has_depth else PlaneDepth(robot.reach, robot.things)
        self._pipeline = ImagePipeline(
            self._body, localiser, self._worker, furniture, floor_m, plane_depth
        )
        self._restore_scene()
        self._rate_ratio = 1.0
        self._next_image_ns = 0
        self._next_scene_ns = 0

    def start(self) -> None:
        """Open sensors, topics and the detector.

        Raises:
            DriverError: a sensor is missing or busy.
            InferenceError: the detector cannot be opened, and the profile requires it.
        """
        # OpenCV's own threads would compete with control for the cores and gain nothing here.
        cv2.setNumThreads(1)
        space = self._space
        self._body.start(space)
        self._pose_tracker.start(space)
        self._writers: dict[str, CellWriter] = {
            name: space.cell_writer(name) for name in ("imu", "scan", "near_obstacles")
        }
        self._scene = space.cell_writer(topics.SCENE)
        self._images: FrameWriter = space.frame_writer(topics.RGBD)
        self._sensors.open()
        self._worker.replace(load_detector(self._shelf, self._profile, 0))

    def step(self) -> None:
        """Read the sensors and publish what follows from it."""
        self._body.read()
        self._read_imu()
        self._pose_tracker.predict(self._clock.now_ns())
        self._read_scan()
        self._read_camera()
        if self._pipeline.finish():
            self._next_scene_ns = 0
        self._move_held()
        self._publish_scene()

    def stop(self) -> None:
        """Release every sensor and the detector."""
        self._sensors.close()
        self._worker.close()
        self._space.close()

    def prepare(self, profile: Profile, model_tier: int) -> PerceptionSetup:
        """Open the detector of a profile.

        Raises:
            InferenceError: it cannot be opened, and the robot would lose the one it has.
        """
        has_one = self._worker.loaded.detector is not None
        loaded = load_detector(self._shelf, profile, model_tier, replaces_one=has_one)
        return PerceptionSetup(profile=profile, loaded=loaded)

    def commit(self, prepared: PerceptionSetup) -> PerceptionSetup:
        """Change rates and detector between two images."""
        replaced = self._worker.replace(prepared.loaded)
        before = PerceptionSetup(profile=self._profile, loaded=replaced)
        self._profile = prepared.profile
        self._sensors.set_camera_rate(prepared.profile.camera_rate_hz)
        return before

    def discard(self, prepared: PerceptionSetup) -> None:
        """Close the detector that is not needed."""
        self._worker.release(prepared.loaded)

    def slow(self, rate_ratio: float) -> None:
        """Process fewer images; lidar, IMU and the robot's pose are not slowed."""
        self._rate_ratio = rate_ratio

    def _read_imu(self) -> None:
        newest = self._sensors.attitude()
        if newest is None:
            return
        self._pose_tracker.add_imu(newest)
        self._writers["imu"].put(
            yaw_rad=newest.yaw_rad,
            pitch_rad=newest.pitch_rad,
            roll_rad=newest.roll_rad,
            acceleration_m_s2=newest.acceleration_m_s2,
        )

    def _read_scan(self) -> None:
        """Publish a scan unless it is out of date already: its readers take it for the present."""
        scan = self._sensors.scan()
        if scan is not None and self._clock.now_ns() - scan.stamp_ns <= STALE_SCAN_NS:
            ages_s = (self._clock.now_ns() - scan.beam_stamp_ns) / NS_PER_S
            self._writers["scan"].put(range_m=scan.range_m, beam_age_s=ages_s)
            self._pose_tracker.correct(scan, self._pipeline.obstacles)

    def _read_camera(self) -> None:
        frame, now_ns = self._sensors.image(), self._clock.now_ns()
        if frame is None:
            return
        self._pipeline.receive(frame, now_ns)
        # By the images' own time: one that had to wait for a step must not drop the next one.
        if frame.stamp_ns < self._next_image_ns:
            return
        rate_hz = self._profile.perception_rate_hz * self._rate_ratio
        self._next_image_ns = frame.stamp_ns + round(EARLY_RATIO * NS_PER_S / rate_hz)
        self._publish_image(frame)
        self._next_scene_ns = 0  # a scene for each image, whatever its use
        if self._pipeline.process(frame) and self._looks_around:
            self._publish_obstacles(1.0 / rate_hz)

    def _publish_obstacles(self, period_s: float) -> None:
        """Publish what stands around the base; the stamp is that of the present pose."""
        pose, now_ns = self._pose_tracker.localiser.pose, self._clock.now_ns()
        points = self._pipeline.obstacles.around(pose, now_ns)
        padded = np.zeros((3, OBSTACLE_POINTS), dtype=np.float32)
        padded[:, : len(points)] = points.T
        x_m, y_m, z_m = padded
        self._writers["near_obstacles"].put(
            count=len(points), period_s=period_s, x_m=x_m, y_m=y_m, z_m=z_m
        )

    def _restore_scene(self) -> None:
        """Restore what an earlier instance in this run knew of things."""
        last = self._space.cell_reader(topics.SCENE).latest()
        if last is not None:
            self._pipeline.scene.restore(last.document())

    def _move_held(self) -> None:
        now_ns = self._clock.now_ns()
        positions = self._body.at(now_ns)
        if positions is not None:
            self._pipeline.move_held(positions, now_ns)

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
        now_ns = self._clock.now_ns()
        if now_ns >= self._next_scene_ns:
            self._next_scene_ns = now_ns + SCENE_PERIOD_NS
            self._scene.put_document(self._pipeline.document(now_ns, self._sensors.away()))


def _pose_of(
    robot: RobotDescription, model: RobotModel, space: SharedSpace
) -> PoseTracker | WheelPose | MountedPose:
    """Return what tells where the robot is: lidar and map, its wheels alone, or where it stands."""
    if robot.finds_its_way:
        return PoseTracker(robot, model, space)
    return MountedPose(robot.start_pose) if robot.parts.base is None else WheelPose(robot, space)
