"""Draw a map while the robot is driven: match each scan with what was seen so far, then add it.

There is no closing of loops: a flat that the lidar sees across needs none, in a long corridor the
error grows with the way, and the map must be looked at before it is used.
"""

from typing import Final

import numpy as np
from numpy.typing import NDArray

from vla_deploy.navigation.localising.pose_filter import GATE, PoseFilter
from vla_deploy.navigation.localising.scan import ScanPoints, placed_beams
from vla_deploy.navigation.localising.scan_match import MIN_POINTS, fit
from vla_deploy.navigation.maps.distance_field import SurfaceField
from vla_deploy.navigation.maps.occupancy import OccupancyGrid
from vla_deploy.robots.floor_pose import ORIGIN, Points, Pose2D

# A scan is added when the robot has moved so far since the last one.
KEY_WAY_M: Final = 0.4
KEY_TURN_RAD: Final = 0.4
FIRST_SCANS: Final = 5
# A grown field has no cells that points share the errors of, and a lag behind the match would be
# drawn into the map: matches count for more than on a map from a file.
SHARPER: Final = 0.05
KNOWN_RATIO: Final = 0.4
FITTING_RATIO: Final = 0.7


class Mapper:
    """Keep the pose and the map; the map's frame is the one that `start` is given in."""

    def __init__(
        self, start: Pose2D = ORIGIN, lidar: Pose2D = ORIGIN, resolution_m: float = 0.05
    ) -> None:
        self.grid = OccupancyGrid(resolution_m)
        self.scans = 0
        self.refused = 0
        self._lidar = lidar
        self._filter = PoseFilter(start)
        self._filter.start_anew(start, np.zeros((3, 3)))
        self._surface = SurfaceField(resolution_m)
        self._key: Pose2D | None = None

    @property
    def pose(self) -> Pose2D:
        """Return where the base is now, in the map's frame."""
        return self._filter.pose

    @property
    def sigma_m(self) -> float:
        """Return how far off the pose may be against the map drawn so far."""
        return self._filter.sigma_m

    def pose_at(self, stamp_ns: int) -> Pose2D:
        """Return where the base was at a moment of the last seconds."""
        return self._filter.pose_at(stamp_ns)

    def predict(self, stamp_ns: int, odometry: Pose2D, imu_yaw_rad: float | None) -> None:
        """Move by what wheels and IMU say since the last call."""
        self._filter.predict(stamp_ns, odometry, imu_yaw_rad)

    def add_scan(self, range_m: NDArray[np.float32], beam_stamp_ns: NDArray[np.int64]) -> bool:
        """Match a scan and add it to the map; return whether it was used.

        Raises:
            MapInvalid: the map has grown beyond every flat.
        """
        scan = placed_beams(self._filter.track, self._lidar, range_m, beam_stamp_ns)
        if len(scan) < MIN_POINTS or not self._match(scan):
            self.refused += 1
            return False
        self.scans += 1
        if self._is_key():
            self._key = self.pose
            on_map = scan.placed(self._filter.map_from_track)
            self._surface.add(on_map)
            self.grid.add_scan(on_map)
        return True

    def add_depth(self, standing: Points, floor: Points, stamp_ns: int) -> None:
        """Add what a depth image shows, (n, 2) points in the base's frame at that moment.

        Raises:
            MapInvalid: the map has grown beyond every flat.
        """
        pose = self.pose_at(stamp_ns)
        self.grid.add_depth(pose.place(standing), pose.place(floor))

    def _match(self, scan: ScanPoints) -> bool:
        """Correct the pose by the part of a scan that shows what is on the map already."""
        if self.scans < FIRST_SCANS:
            return True
        on_map = scan.placed(self._filter.map_from_track)
        known = self._surface.is_known(on_map.ends)
        if np.count_nonzero(known) < max(MIN_POINTS, KNOWN_RATIO * len(scan)):
            return False
        seen_before = ScanPoints(on_map.starts[known], on_map.ends[known])
        match = fit(self._surface.field, seen_before, self.pose)
        if match.match_ratio < FITTING_RATIO:
            return False
        if self._filter.surprise(match.shift, match.covariance) > GATE:
            self._filter.doubt(match.shift)
            return False
        self._filter.correct(match.shift, SHARPER * match.covariance)
        return True

    def _is_key(self) -> bool:
        if self._key is None or self.scans <= FIRST_SCANS:
            return True
        moved = self.pose.distance_m(self._key) > KEY_WAY_M
        return moved or self.pose.turn_rad(self._key) > KEY_TURN_RAD
