"""Give the pose of a base that no lidar places: where its wheels say that it has gone."""

from typing import Final

import numpy as np

from drivers.imu.base import ImuSample
from drivers.lidar.base import Scan
from vla_deploy.client.place_state import Doubt, PlaceState
from vla_deploy.ipc import CellReader, CellWriter, SharedSpace, topics
from vla_deploy.navigation.localising.dead_reckoning import DeadReckoning
from vla_deploy.perception.objects.near_obstacles import NearObstacles
from vla_deploy.perception.pose_tracker import FRESH_YAW_NS, start_pose
from vla_deploy.robots import RobotDescription
from vla_deploy.robots.floor_pose import Pose2D


class WheelPose:
    """Give and publish the dead-reckoned pose, from where the robot was switched on.

    It drifts with the way, and nothing notices: good for distances and turns, and for things in
    view, not for going back to a place. Its covariance grows as the wheels may have slipped.
    """

    state: Final = PlaceState.TRACKING
    is_anchored: Final = True

    def __init__(self, robot: RobotDescription, space: SharedSpace) -> None:
        """Start where an earlier instance in this run ended."""
        self._start = start_pose(robot, space)
        self._reckoning = DeadReckoning()
        self._variance = np.zeros(3)
        self._imu_yaw_rad: float | None = None
        self._imu_ns = 0
        self._base_stamp_ns = -1

    @property
    def localiser(self) -> "WheelPose":
        """Return what tells where the base is."""
        return self

    @property
    def pose(self) -> Pose2D:
        """Return where the base is now."""
        return self._start.compose(self._reckoning.pose)

    def pose_at(self, stamp_ns: int) -> Pose2D:
        """Return where the base was."""
        return self._start.compose(self._reckoning.at(stamp_ns))

    def track_at(self, stamp_ns: int) -> Pose2D:
        """Return where the base was by dead reckoning."""
        return self._reckoning.at(stamp_ns)

    def start(self, space: SharedSpace) -> None:
        """Open the topics."""
        self._base_state: CellReader = space.cell_reader(topics.BASE_STATE)
        self._writer: CellWriter = space.cell_writer(topics.POSE)

    def add_imu(self, newest: ImuSample) -> None:
        """Use a sample of the IMU from the next step on."""
        self._imu_yaw_rad, self._imu_ns = newest.yaw_rad, newest.stamp_ns

    def predict(self, now_ns: int) -> None:
        """Dead-reckon and publish; without wheel odometry the pose stays as it is."""
        sample = self._base_state.latest()
        if sample is not None and sample.stamp_ns != self._base_stamp_ns:
            self._base_stamp_ns = sample.stamp_ns
            is_fresh = now_ns - self._imu_ns <= FRESH_YAW_NS
            step = self._reckoning.move(
                sample.stamp_ns, Pose2D.of(sample.data), self._imu_yaw_rad if is_fresh else None
            )
            way_m2 = step.along_m2 + step.across_m2  # whichever way it looked
            self._variance += (way_m2, way_m2, step.turn_rad2)
        pose = self.pose
        self._writer.put(
            x_m=pose.x_m,
            y_m=pose.y_m,
            yaw_rad=pose.yaw_rad,
            match_ratio=1.0,
            covariance=np.diag(self._variance).ravel(),
            state=self.state,
            doubt=Doubt.NONE,
        )

    def correct(self, scan: Scan, obstacles: NearObstacles) -> None:
        """Leave a scan aside."""
