"""Move the robot through the twin's flat without physics; its sensors and their drivers are real.

Lidar and IMU are the twin's emulated devices, read by the robot's drivers; the wheels are reckoned,
with slip. So an hour of driving takes minutes, and what every estimator gets is the same.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Final

import mujoco
import numpy as np
from numpy.typing import NDArray

from drivers.imu.bno085_rvc import Bno085Rvc
from drivers.lidar.base import Scan
from drivers.lidar.ld19 import Ld19
from sim_twin.physics.compose import ROBOT_ROOT
from sim_twin.physics.load import load_model
from sim_twin.physics.probes import RangeProbe
from sim_twin.ports.lines import MemoryLine
from sim_twin.sensors.imu import ImuDevice, ImuTruth
from sim_twin.sensors.lidar import LidarDevice
from sim_twin.worlds.placement import draw_poses
from vla_deploy.control.output.base_kinematics import base_kinematics
from vla_deploy.control.output.odometry import Odometry
from vla_deploy.navigation.follower import AT_REST, DriveLimits, FollowerPhase, PathFollower, Twist
from vla_deploy.navigation.path_planning import PathPlanner
from vla_deploy.robots import RobotDescription
from vla_deploy.robots.floor_pose import Pose2D

STEP_NS: Final = 10_000_000
STEPS_PER_READING: Final = 2
_STEP_S: Final = STEP_NS / 1e9
_SLIP_MEMORY: Final = 0.995


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PushedReading:
    """Hold what the robot's perception gets at one moment, and the truth."""

    stamp_ns: int
    odometry: Pose2D
    imu_yaw_rad: float
    scan: Scan | None
    truth: Pose2D


class PushedRobot:
    """Stand and drive anywhere; `slip_ratio` is how much further the wheels turn than they get."""

    def __init__(
        self,
        robot: RobotDescription,
        world: str = "flat",
        seed: int = 0,
        *,
        slip_ratio: float = 0.0,
        lidar_sigma_m: float = 0.005,
    ) -> None:
        self.now = 1_000_000_000
        self.pose = robot.start_pose
        self._model = load_model(robot, world)
        self._data = mujoco.MjData(self._model)
        for name, placed in draw_poses(world, seed).items():
            self._put(name, placed.position_m, placed.yaw_rad)
        self._random = np.random.default_rng(seed)
        self._slip_ratio, self._slip_change = slip_ratio, np.zeros(2)
        drive = base_kinematics(robot.base)
        self._drive, self._odometry = drive, Odometry(drive)
        self._wheels_rad = np.zeros(2)
        self._odometry.update(0.0, 0.0)
        self._stand()
        cast = RangeProbe(self._model, self._data).cast
        self.lidar = LidarDevice(cast, sigma_m=lidar_sigma_m, seed=seed)
        self.imu = ImuDevice(self._feel, seed=seed)
        self._lidar_driver = Ld19(MemoryLine(self.lidar, self), self)
        self._imu_driver = Bno085Rvc(MemoryLine(self.imu, self), self)
        self._imu_yaw_rad = 0.0

    def now_ns(self) -> int:
        """Return simulated time; the drivers' clock."""
        return self.now

    def sleep_until(self, deadline_ns: int) -> None:
        """Refuse: no driver waits."""
        raise AssertionError(f"a driver wants to sleep until {deadline_ns}")

    def carry_to(self, pose: Pose2D) -> None:
        """Put the robot elsewhere at once, as a kidnapper does; its wheels do not turn."""
        self.pose = pose
        self._stand()

    def read(self, twist: Twist = AT_REST) -> PushedReading:
        """Move for as long as perception's period, and return what it gets then."""
        for _ in range(STEPS_PER_READING):
            self._move(twist)
            self.lidar.step(self.now)
            self.imu.step(self.now)
        samples = self._imu_driver.poll()
        if samples:
            self._imu_yaw_rad = samples[-1].yaw_rad
        told = self._odometry
        return PushedReading(
            stamp_ns=self.now,
            odometry=Pose2D(told.x_m, told.y_m, told.yaw_rad),
            imu_yaw_rad=self._imu_yaw_rad,
            scan=self._lidar_driver.poll(),
            truth=self.pose,
        )

    def _move(self, twist: Twist) -> None:
        self.now += STEP_NS
        turn_rad, way_m = twist.w_rad_s * _STEP_S, twist.v_m_s * _STEP_S
        half = Pose2D(0.0, 0.0, turn_rad / 2)
        self.pose = self.pose.compose(half).compose(Pose2D(way_m, 0.0, 0.0)).compose(half)
        self._slip_change = _SLIP_MEMORY * self._slip_change + self._random.normal(0.0, 0.1, 2)
        slip = self._slip_ratio * (1.0 + 0.5 * self._slip_change)
        speeds = np.array(self._drive.wheel_speeds(twist.v_m_s, twist.w_rad_s))
        self._wheels_rad += speeds * _STEP_S * (1.0 + slip)
        self._odometry.update(*self._wheels_rad.tolist())
        if twist.v_m_s or twist.w_rad_s:
            self._stand()

    def _stand(self) -> None:
        self._put(ROBOT_ROOT, (self.pose.x_m, self.pose.y_m, 0.0), self.pose.yaw_rad)
        mujoco.mj_kinematics(self._model, self._data)

    def _put(self, body: str, position_m: Sequence[float], yaw_rad: float) -> None:
        start = self._model.jnt_qposadr[self._model.body(body).jntadr[0]]
        turn = (math.cos(yaw_rad / 2), 0.0, 0.0, math.sin(yaw_rad / 2))
        self._data.qpos[start : start + 7] = (*position_m, *turn)

    def _feel(self) -> ImuTruth:
        return ImuTruth(self.pose.yaw_rad, 0.0, 0.0, (0.0, 0.0, 9.81))


def tour(
    moved: PushedRobot,
    planner: PathPlanner,
    limits: DriveLimits,
    stops: Sequence[Pose2D],
    length_m: float,
) -> Iterator[PushedReading]:
    """Drive from stop to stop, again and again, until the way is long enough."""
    driven_m = 0.0
    while driven_m < length_m:
        for stop in stops:
            here = moved.pose
            points: NDArray[np.float64] = planner.plan((here.x_m, here.y_m), (stop.x_m, stop.y_m))
            follower = PathFollower(points, limits, stop.yaw_rad)
            while follower.phase is not FollowerPhase.ARRIVED:
                pose = moved.pose
                reading = moved.read(follower.step(pose.x_m, pose.y_m, pose.yaw_rad))
                driven_m += pose.distance_m(moved.pose)
                yield reading
                if driven_m >= length_m:
                    return
