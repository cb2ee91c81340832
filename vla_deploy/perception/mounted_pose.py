"""Give the pose of a robot that is mounted where it stands: it never changes, and is never lost."""

from typing import Final

import numpy as np

from drivers.imu.base import ImuSample
from drivers.lidar.base import Scan
from vla_deploy.client.place_state import Doubt, PlaceState
from vla_deploy.ipc import CellWriter, SharedSpace, topics
from vla_deploy.perception.objects.near_obstacles import NearObstacles
from vla_deploy.robots.floor_pose import Pose2D


class MountedPose:
    """Give and publish the pose, as PoseTracker and its localiser do for a robot with a base."""

    state: Final = PlaceState.TRACKING
    is_anchored: Final = True

    def __init__(self, pose: Pose2D) -> None:
        self.pose: Final = pose

    @property
    def localiser(self) -> "MountedPose":
        """Return what tells where the base is."""
        return self

    def pose_at(self, stamp_ns: int) -> Pose2D:
        """Return where the base was."""
        return self.pose

    def track_at(self, stamp_ns: int) -> Pose2D:
        """Return where the base was by dead reckoning."""
        return self.pose

    def start(self, space: SharedSpace) -> None:
        """Open the topic."""
        self._writer: CellWriter = space.cell_writer(topics.POSE)

    def add_imu(self, newest: ImuSample) -> None:
        """Leave a sample of the IMU aside."""

    def predict(self, now_ns: int) -> None:
        """Publish the pose."""
        self._writer.put(
            x_m=self.pose.x_m,
            y_m=self.pose.y_m,
            yaw_rad=self.pose.yaw_rad,
            match_ratio=1.0,
            covariance=np.zeros(9),
            state=self.state,
            doubt=Doubt.NONE,
        )

    def correct(self, scan: Scan, obstacles: NearObstacles) -> None:
        """Leave a scan aside."""
