"""Draw a map from a running robot's sensor topics while somebody drives it around."""

from typing import Final

import numpy as np

from drivers.camera.protocol import Intrinsics
from drivers.clock import NS_PER_S
from vla_deploy.client.place_state import PlaceState
from vla_deploy.ipc import Sample, SharedSpace, topics
from vla_deploy.ipc.rgbd_image import depths_m
from vla_deploy.navigation.maps.mapping import Mapper
from vla_deploy.perception.geometry.cloud import sparse_points
from vla_deploy.perception.geometry.geometry_grid import geometry_grid
from vla_deploy.perception.objects.body_state import BodyState
from vla_deploy.perception.pose_tracker import lidar_place
from vla_deploy.robots import RobotDescription
from vla_deploy.robots.floor_pose import ORIGIN, Points, Pose2D
from vla_deploy.robots.kinematics.model import RobotModel

FRESH_YAW_NS: Final = NS_PER_S // 10
DEPTH_M: Final = (0.25, 2.5)
# Lower is floor, higher passes over the robot's head; what lies between floor and band is neither.
FLOOR_M: Final = 0.02
LOWEST_M, HIGHEST_M = 0.06, 1.25
CELL_M: Final = 0.05
MIN_PIXELS: Final = 3


class MapRecorder:
    """Read the topics and feed a mapper.

    Where the robot knows its pose, the new map has the frame of the old one; otherwise it begins
    where the robot stands.
    """

    def __init__(
        self, robot: RobotDescription, space: SharedSpace, resolution_m: float = 0.05
    ) -> None:
        """Open the topics.

        Raises:
            RobotFileError: the MJCF does not fit the robot file.
        """
        model = RobotModel(robot)
        self._scan, self._imu = space.cell_reader(topics.SCAN), space.cell_reader(topics.IMU)
        self._base_state = space.cell_reader(topics.BASE_STATE)
        self._images = space.frame_reader(topics.RGBD)
        self._body = BodyState(robot, model)
        self._body.start(space)
        self._camera = robot.camera
        start = _tracked_pose(space.cell_reader(topics.POSE).latest())
        self.on_old_frame = start is not None
        self.mapper = Mapper(start or ORIGIN, lidar_place(robot, model), resolution_m)
        self._last = {"base_state": -1, "scan": -1, "rgbd": -1}

    def step(self) -> None:
        """Process what is new; to be called some fifty times a second.

        Raises:
            MapInvalid: the map has grown too large.
        """
        self._body.read()
        moved = self._base_state.latest()
        if moved is None or not self._is_new("base_state", moved.stamp_ns):
            return
        yaw_rad = self._imu_yaw_rad(moved.stamp_ns)
        self.mapper.predict(moved.stamp_ns, Pose2D.of(moved.data), yaw_rad)
        scan = self._scan.latest()
        if scan is not None and self._is_new("scan", scan.stamp_ns):
            ages_ns = np.rint(scan.data["beam_age_s"] * NS_PER_S).astype(np.int64)
            self.mapper.add_scan(np.array(scan.data["range_m"]), scan.stamp_ns - ages_ns)
        self._add_image()

    def _add_image(self) -> None:
        """Add what the camera sees between floor and head, once scans have begun the map."""
        frame = self._images.latest()
        if frame is None or not self.mapper.scans or not self._is_new("rgbd", frame.stamp_ns):
            return
        positions = self._body.at(frame.stamp_ns)
        if positions is None:
            return
        grid = geometry_grid(self._intrinsics(frame.width, frame.height))
        points = sparse_points(
            grid.depth(depths_m(frame)),
            grid.camera,
            self._body.camera_pose(positions),
            self._body.mask(positions, grid.camera),
            within_m=DEPTH_M,
        )
        height_m = points[:, 2]
        standing = points[(height_m > LOWEST_M) & (height_m < HIGHEST_M), :2]
        floor = points[np.abs(height_m) < FLOOR_M, :2]
        self.mapper.add_depth(_without_noise(standing), _without_noise(floor), frame.stamp_ns)

    def _imu_yaw_rad(self, now_ns: int) -> float | None:
        sample = self._imu.latest()
        if sample is None or now_ns - sample.stamp_ns > FRESH_YAW_NS:
            return None
        return float(sample.data["yaw_rad"])

    def _is_new(self, topic: str, stamp_ns: int) -> bool:
        before, self._last[topic] = self._last[topic], stamp_ns
        return stamp_ns != before

    def _intrinsics(self, width: int, height: int) -> Intrinsics:
        """Return the calibrated lens; of images of another size, a pinhole as wide as theirs."""
        known = self._camera.intrinsics
        if (width, height) == (known.width, known.height):
            return known
        focal_px = self._camera.focal_px * height / self._camera.height
        return Intrinsics(
            width=width,
            height=height,
            fx=focal_px,
            fy=focal_px,
            cx=(width - 1) / 2,
            cy=(height - 1) / 2,
        )


def _tracked_pose(sample: Sample | None) -> Pose2D | None:
    """Return the robot's pose on its present map, None where it is not tracked."""
    if sample is None or int(sample.data["state"]) != PlaceState.TRACKING:
        return None
    return Pose2D.of(sample.data)


def _without_noise(points: Points) -> Points:
    """Return the points in whose cell several lie."""
    if not len(points):
        return points
    cells = np.floor(points / CELL_M).astype(np.int64)
    _, at, counts = np.unique(cells, axis=0, return_inverse=True, return_counts=True)
    kept: Points = points[counts[at.ravel()] >= MIN_PIXELS]
    return kept
