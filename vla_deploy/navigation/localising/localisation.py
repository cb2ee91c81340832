"""Know where the robot is, how surely, and when it does not know.

Wheels and IMU carry the pose on, scans fitted to the map correct it, by an extended Kalman filter.
Scans that do not fit make it unsure, then lost; a lost robot searches the whole map for itself.
"""

from collections import deque
from typing import Final

import numpy as np
from numpy.typing import NDArray

from vla_deploy.client.place_state import Doubt, PlaceState
from vla_deploy.navigation.localising.place_judge import (
    MATCH_RATIO,
    THROUGH_RATIO,
    PlaceJudge,
)
from vla_deploy.navigation.localising.pose_filter import GATE, PoseFilter
from vla_deploy.navigation.localising.relocalisation import Relocaliser
from vla_deploy.navigation.localising.scan import ScanPoints, placed_beams
from vla_deploy.navigation.localising.scan_match import MIN_POINTS, Match, fit
from vla_deploy.navigation.maps.distance_field import DistanceField
from vla_deploy.robots.floor_pose import ORIGIN, Pose2D
from vla_deploy.robots.maps.grid_map import GridMap

# However often it is measured, no pose is better known than the map is drawn.
MAP_COVARIANCE: Final = np.diag((0.01**2, 0.01**2, 0.008**2))
# How well it is known when a beam was measured: serial lines and lidars hold packets back.
BEAM_TIMING_S: Final = 0.02
# Noise makes two scans differ: one that repeats itself bit for bit is not the present.
FROZEN_SCANS: Final = 4
# A match that the filter did not expect is believed when it comes so often, and fits so well.
STUBBORN_SCANS: Final = 3
STUBBORN_RATIO: Final = 0.8
# Heading that scan after scan finds off to one side is led astray, though no scan surprises alone:
# an IMU's yaw may run away slowly.
ASTRAY_SCANS: Final = 3
ASTRAY_RAD: Final = 0.05
MAX_SHIFT_M: Final = 0.4
MAX_TURN_RAD: Final = 0.3


class Localiser:
    """Keep the pose of the base on the map; `lidar` is the sensor's place on the base.

    `match_ratio` is the share of the last scan's points that lie on the map's walls.
    """

    def __init__(self, start: Pose2D, grid: GridMap, lidar: Pose2D | None = None) -> None:
        self.match_ratio = 0.0
        self.seen: ScanPoints | None = None
        """The newest scan in the map frame; None where it did not bear out the pose."""
        self._lidar = lidar or ORIGIN
        self._field = DistanceField.of(grid)
        self._filter = PoseFilter(start)
        self._judge = PlaceJudge()
        self._relocaliser = Relocaliser(self._field)
        self._last_ranges: NDArray[np.float32] | None = None
        self._repeats = 0
        self._unexpected = 0
        self._turns: deque[float] = deque(maxlen=ASTRAY_SCANS)

    @property
    def pose(self) -> Pose2D:
        """Return where the base is now, in the map frame."""
        return self._filter.pose

    @property
    def covariance(self) -> NDArray[np.float64]:
        """Return the pose's covariance, (3, 3) over x, y (m) and yaw (rad), with the map's own."""
        return self._filter.covariance + MAP_COVARIANCE

    @property
    def state(self) -> PlaceState:
        """Return what the pose is worth."""
        return self._judge.state

    @property
    def doubt(self) -> Doubt:
        """Return why the pose is in doubt."""
        return self._judge.doubt

    @property
    def is_anchored(self) -> bool:
        """Return whether scans have borne out a place since the start, or since it was lost."""
        return self._judge.is_anchored

    def pose_at(self, stamp_ns: int) -> Pose2D:
        """Return where the base was; the nearest known moment where `stamp_ns` is out of range."""
        return self._filter.pose_at(stamp_ns)

    def track_at(self, stamp_ns: int) -> Pose2D:
        """Return where the base was by dead reckoning alone, which drifts but never jumps."""
        return self._filter.track.at(stamp_ns)

    def predict(self, stamp_ns: int, odometry: Pose2D, imu_yaw_rad: float | None) -> None:
        """Move by what wheels and IMU say since the last call, and search while lost."""
        self._filter.predict(stamp_ns, odometry, imu_yaw_rad)
        self._judge.pass_time(stamp_ns, self._filter.sigma_m, self._filter.sigma_rad)
        if self.state is PlaceState.LOST:
            self._relocaliser.work()

    def correct(self, range_m: NDArray[np.float32], beam_stamp_ns: NDArray[np.int64]) -> bool:
        """Pull the pose towards where the scan fits the map; return whether it was used."""
        stamp_ns, self.seen = int(beam_stamp_ns.max(initial=0)), None
        scan = placed_beams(self._filter.track, self._lidar, range_m, beam_stamp_ns)
        if len(scan) < MIN_POINTS or self._is_frozen(range_m):
            self.match_ratio = 0.0
            self._judge_scan(stamp_ns, Doubt.NO_SCAN)
            return False
        if self.state is PlaceState.LOST:
            self._search(stamp_ns, scan)
            return False
        match = fit(self._field, scan.placed(self._filter.map_from_track), self.pose)
        self.match_ratio = match.match_ratio
        noise = match.covariance + self._timing_covariance()
        doubt = self._doubt_of(match, noise)
        if doubt is Doubt.NONE:
            if self._is_astray(float(match.shift[2])):
                self._filter.doubt(match.shift)
            self._filter.correct(match.shift, noise)
            self.seen = scan.placed(self._filter.map_from_track)
        self._judge_scan(stamp_ns, doubt)
        return doubt is Doubt.NONE

    def _timing_covariance(self) -> NDArray[np.float64]:
        """Return what uncertain stamps of the beams make of a scan that is taken in motion."""
        speed_m_s, rate_rad_s = self._filter.track.speed()
        way_m, turn_rad = BEAM_TIMING_S * speed_m_s, BEAM_TIMING_S * rate_rad_s
        return np.diag((way_m**2, way_m**2, turn_rad**2))

    def _doubt_of(self, match: Match, noise: NDArray[np.float64]) -> Doubt:
        if match.match_ratio < MATCH_RATIO:
            return Doubt.POOR_MATCH
        if match.through_ratio > THROUGH_RATIO:
            return Doubt.THROUGH_WALLS
        shift, turn = match.shift, abs(float(match.shift[2]))
        too_far = float(np.hypot(shift[0], shift[1])) > MAX_SHIFT_M or turn > MAX_TURN_RAD
        if not too_far and self._filter.surprise(shift, noise) <= GATE:
            self._unexpected = 0
            return Doubt.NONE
        self._unexpected += 1
        stubborn = self._unexpected >= STUBBORN_SCANS and match.match_ratio >= STUBBORN_RATIO
        if stubborn and not too_far:
            self._filter.doubt(shift)
        return Doubt.INCONSISTENT

    def _is_astray(self, turn_rad: float) -> bool:
        """Take by how much a scan turns the pose; return whether the last ones did so one way."""
        self._turns.append(turn_rad)
        low, high = min(self._turns), max(self._turns)
        far = low > ASTRAY_RAD or high < -ASTRAY_RAD
        return far and len(self._turns) == ASTRAY_SCANS

    def _search(self, stamp_ns: int, scan: ScanPoints) -> None:
        """Look for the place that a lost robot's scans fit."""
        found = self._relocaliser.take(scan, self._filter.track.pose)
        self._judge.search_found(self._relocaliser.places)
        if found is None:
            return
        self._filter.start_anew(found.pose, found.covariance)
        self.match_ratio = found.match_ratio
        self._judge.found(stamp_ns)
        self._relocaliser.reset()
        self._unexpected = 0

    def _judge_scan(self, stamp_ns: int, doubt: Doubt) -> None:
        sigma_m, sigma_rad = self._filter.sigma_m, self._filter.sigma_rad
        self._judge.take(stamp_ns, doubt, self.match_ratio, sigma_m, sigma_rad)

    def _is_frozen(self, range_m: NDArray[np.float32]) -> bool:
        same = self._last_ranges is not None and np.array_equal(self._last_ranges, range_m)
        self._repeats = self._repeats + 1 if same else 0
        self._last_ranges = np.array(range_m)
        return self._repeats >= FROZEN_SCANS
