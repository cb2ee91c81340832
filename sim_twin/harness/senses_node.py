"""Tell control what a driving base is judged by where perception, which needs a camera, is away."""

from typing import Final

from drivers import registry
from drivers.clock import NS_PER_S
from drivers.imu.base import Imu
from drivers.lidar.base import Lidar
from drivers.opener import DeviceOpener
from vla_deploy.ipc import BY_NAME, SharedSpace, topics
from vla_deploy.perception.pose_tracker import PoseTracker
from vla_deploy.robots import RobotDescription
from vla_deploy.robots.kinematics.model import RobotModel
from vla_deploy.runtime.node import NodeContext

LOOK_PERIOD_S: Final = 1.0 / BY_NAME["near_obstacles"].rate_hz


class SensesNode:
    """Publish scan, attitude and pose by the robot's real drivers; its camera sees an empty floor.

    The pose follows wheels and IMU from where the robot starts; scans do not correct it.
    """

    period_s = 0.02

    def __init__(
        self, context: NodeContext, robot: RobotDescription, devices: DeviceOpener
    ) -> None:
        """Open lidar and IMU.

        Raises:
            DriverError: one of them is missing or busy.
            MapInvalid: the robot file's map cannot be used.
        """
        self._clock = clock = context.clock
        lidar, imu = devices.serial(robot.lidar.device), devices.serial(robot.imu.device)
        self._lidar: Lidar = registry.open_lidar(robot.lidar.model, lidar, clock)
        self._imu: Imu = registry.open_imu(robot.imu.model, imu, clock)
        self._space = SharedSpace(context.run_dir / "ipc", clock)
        self._pose_tracker = PoseTracker(robot, RobotModel(robot), self._space)
        self._scan = self._space.cell_writer(topics.SCAN)
        self._attitude = self._space.cell_writer(topics.IMU)
        self._obstacles = self._space.cell_writer(topics.NEAR_OBSTACLES)
        self._next_look_ns = 0

    def start(self) -> None:
        """Open the pose's topics; the rest is open."""
        self._pose_tracker.start(self._space)

    def step(self) -> None:
        """Publish what is new.

        Raises:
            LinkLost: a line has gone.
        """
        self._tell_attitude()
        self._pose_tracker.predict(self._clock.now_ns())
        self._tell_scan()
        if self._clock.now_ns() >= self._next_look_ns:
            self._next_look_ns = self._clock.now_ns() + round(LOOK_PERIOD_S * NS_PER_S)
            self._obstacles.put(count=0, period_s=LOOK_PERIOD_S, x_m=(), y_m=(), z_m=())

    def stop(self) -> None:
        """Release lidar and IMU."""
        self._lidar.close()
        self._imu.close()
        self._space.close()

    def _tell_attitude(self) -> None:
        samples = self._imu.poll()
        if not samples:
            return
        newest = samples[-1]
        self._pose_tracker.add_imu(newest)
        self._attitude.put(
            yaw_rad=newest.yaw_rad,
            pitch_rad=newest.pitch_rad,
            roll_rad=newest.roll_rad,
            acceleration_m_s2=newest.acceleration_m_s2,
        )

    def _tell_scan(self) -> None:
        scan = self._lidar.poll()
        if scan is not None:
            ages_s = (self._clock.now_ns() - scan.beam_stamp_ns) / NS_PER_S
            self._scan.put(range_m=scan.range_m, beam_age_s=ages_s)
