"""Track the robot's pose: wheels and IMU from step to step, the lidar against the map."""

from collections.abc import Sequence
from typing import Final

import numpy as np

from drivers.clock import NS_PER_S
from drivers.imu.base import ImuSample
from drivers.lidar.base import Scan
from vla_deploy.client.place_state import PlaceState
from vla_deploy.ipc import CellReader, CellWriter, SharedSpace, topics
from vla_deploy.ipc.topics import MOVERS, OBSTACLE_POINTS
from vla_deploy.navigation.localising.localisation import Localiser
from vla_deploy.navigation.obstacles.live_obstacles import LiveObstacles
from vla_deploy.perception.objects.near_obstacles import NearObstacles
from vla_deploy.robots import RobotDescription
from vla_deploy.robots.floor_pose import Points, Pose2D
from vla_deploy.robots.kinematics.model import RobotModel, full_positions
from vla_deploy.robots.maps.grid_map import load_map

# Without a new yaw for this long, the wheels give the turn.
FRESH_YAW_NS = NS_PER_S // 25
_MOVER_FIELDS: Final = ("mover_x_m", "mover_y_m", "mover_vx_m_s", "mover_vy_m_s")


class PoseTracker:
    """Feed the `localiser` from the topics and the sensors, and publish the pose."""

    def __init__(self, robot: RobotDescription, model: RobotModel, space: SharedSpace) -> None:
        """Read the map, and start where an earlier instance in this run ended.

        Raises:
            MapInvalid: the robot file's map cannot be used.
        """
        lidar, grid = lidar_place(robot, model), load_map(robot.home.map_path)
        self.localiser = Localiser(start_pose(robot, space), grid, lidar)
        self._live = LiveObstacles(grid)
        self._imu_yaw_rad: float | None = None
        self._imu_ns = 0
        self._base_stamp_ns = -1

    def start(self, space: SharedSpace) -> None:
        """Open the topics."""
        self._base_state: CellReader = space.cell_reader(topics.BASE_STATE)
        self._writer: CellWriter = space.cell_writer(topics.POSE)
        self._live_writer: CellWriter = space.cell_writer(topics.LIVE_OBSTACLES)

    def add_imu(self, newest: ImuSample) -> None:
        """Use a sample of the IMU from the next step on."""
        self._imu_yaw_rad, self._imu_ns = newest.yaw_rad, newest.stamp_ns

    def predict(self, now_ns: int) -> None:
        """Dead-reckon and publish; without wheel odometry the pose stays as it is."""
        sample = self._base_state.latest()
        if sample is not None and sample.stamp_ns != self._base_stamp_ns:
            self._base_stamp_ns = sample.stamp_ns
            odometry, yaw_rad = Pose2D.of(sample.data), self._fresh_yaw_rad(now_ns)
            self.localiser.predict(sample.stamp_ns, odometry, yaw_rad)
        pose = self.localiser.pose
        self._writer.put(
            x_m=pose.x_m,
            y_m=pose.y_m,
            yaw_rad=pose.yaw_rad,
            match_ratio=self.localiser.match_ratio,
            covariance=self.localiser.covariance.ravel(),
            state=self.localiser.state,
            doubt=self.localiser.doubt,
        )

    def correct(self, scan: Scan, obstacles: NearObstacles) -> None:
        """Correct the pose by a scan, and publish what it and the depth camera show beside the map.

        What the camera remembers of somebody whom the lidar has seen walk away is forgotten.
        """
        localiser = self.localiser
        localiser.correct(scan.range_m, scan.beam_stamp_ns)
        if localiser.seen is not None and localiser.state is PlaceState.TRACKING:
            self._live.see(localiser.seen, scan.stamp_ns)
        pose = localiser.pose
        at = np.array((pose.x_m, pose.y_m))
        obstacles.forget_left(self._live.left(scan.stamp_ns))
        low = obstacles.on_map(scan.stamp_ns)[:, :2]
        points = np.vstack((low[self._live.unmapped(low)], self._live.around(at, scan.stamp_ns)))
        points = points[np.argsort(np.hypot(*(points - at).T), kind="stable")][:OBSTACLE_POINTS]
        movers = np.array(self._live.movers[:MOVERS], dtype=np.float64).reshape(-1, 4)
        self._live_writer.put(
            count=len(points),
            **_columns(points, OBSTACLE_POINTS, ("x_m", "y_m")),
            mover_count=len(movers),
            **_columns(movers, MOVERS, _MOVER_FIELDS),
        )

    def _fresh_yaw_rad(self, now_ns: int) -> float | None:
        """Return the IMU's yaw unless it is out of date: a frozen one would hide all turns."""
        return self._imu_yaw_rad if now_ns - self._imu_ns <= FRESH_YAW_NS else None


def _columns(rows: Points, most: int, names: Sequence[str]) -> dict[str, Points]:
    """Return the columns of (n, k) rows by name, each filled up with zeros."""
    filled = np.zeros((len(names), most))
    filled[:, : len(rows)] = rows.T
    return dict(zip(names, filled, strict=True))


def lidar_place(robot: RobotDescription, model: RobotModel) -> Pose2D:
    """Return where the lidar is on the base.

    The driver has turned the beams: they count from the robot's front.
    """
    x_m, y_m, _ = model.site_pose(robot.lidar.site, full_positions(robot))[:3, 3]
    return Pose2D(float(x_m), float(y_m), 0.0)


def start_pose(robot: RobotDescription, space: SharedSpace) -> Pose2D:
    """Return where an earlier instance in this run ended, else where the robot is switched on."""
    last = space.cell_reader(topics.POSE).latest()
    return robot.start_pose if last is None else Pose2D.of(last.data)
