"""The peer of the localiser: a fixed share of each scan's correction, no covariance, never lost.

This is what the robot used before; a scan moves the pose by Gauss-Newton, gently, when it fits.
"""

import math
from collections import deque

import numpy as np
from numpy.typing import NDArray

from vla_deploy.navigation.maps.distance_field import DistanceField
from vla_deploy.robots.floor_pose import Points, Pose2D, wrap_angle
from vla_deploy.robots.maps.grid_map import GridMap

HISTORY_NS = 2_000_000_000
ODOMETRY_JUMP_M = 0.3
MAX_BEAM_M = 8.0
MIN_BEAM_M = 0.25
MIN_POINTS = 60
INLIER_M = 0.30
MATCH_M = 0.10
MIN_MATCH_RATIO = 0.6
ITERATIONS = 6
GAIN = 0.35
# A corridor says nothing about the way along it: this holds the estimate there.
DAMPING = 4.0
MAX_SHIFT_M = 0.4
MAX_TURN_RAD = 0.25


class FixedGainLocaliser:
    """Keep the pose of the base on the map; `lidar` is the sensor's place on the base."""

    def __init__(self, start: Pose2D, grid: GridMap, lidar: Pose2D | None = None) -> None:
        self.match_ratio = 0.0
        self._lidar = lidar or Pose2D(0.0, 0.0, 0.0)
        self._field = DistanceField.of(grid)
        self._map_from_track = start
        self._track = Pose2D(0.0, 0.0, 0.0)
        self._odometry: Pose2D | None = None
        self._imu_yaw_rad: float | None = None
        self._history: deque[tuple[int, Pose2D]] = deque()

    @property
    def pose(self) -> Pose2D:
        """Return where the base is now, in the map frame."""
        return self._map_from_track.compose(self._track)

    def pose_at(self, stamp_ns: int) -> Pose2D:
        """Return where the base was; the nearest known moment where `stamp_ns` is out of range."""
        return self._map_from_track.compose(self._track_at(stamp_ns))

    def predict(self, stamp_ns: int, odometry: Pose2D, imu_yaw_rad: float | None) -> Pose2D:
        """Move by what wheels (distance) and IMU (turn) say since the last call; return the pose.

        Without an IMU the wheels' turn is taken.
        """
        step = odometry.relative_to(self._odometry or odometry)
        turn_rad = step.yaw_rad
        if imu_yaw_rad is not None and self._imu_yaw_rad is not None:
            turn_rad = wrap_angle(imu_yaw_rad - self._imu_yaw_rad)
        if math.hypot(step.x_m, step.y_m) > ODOMETRY_JUMP_M:
            # Odometry begins anew when control restarts: the robot has not moved.
            step = Pose2D(0.0, 0.0, 0.0)
        self._odometry, self._imu_yaw_rad = odometry, imu_yaw_rad
        self._track = self._track.compose(Pose2D(step.x_m, step.y_m, turn_rad))
        self._remember(stamp_ns)
        return self.pose

    def correct(self, range_m: NDArray[np.float32], beam_stamp_ns: NDArray[np.int64]) -> bool:
        """Pull the pose towards where the scan fits the map; tell whether it was used."""
        points = self._points(range_m, beam_stamp_ns)
        if len(points) < MIN_POINTS:
            self.match_ratio = 0.0
            return False
        pose = self.pose
        pivot = np.array([pose.x_m, pose.y_m])
        on_map = self._on_map(points)
        delta = self._fit(on_map, pivot)
        distance_m, _ = self._field.sample(_transformed(on_map, pivot, delta))
        self.match_ratio = float(np.mean(np.abs(distance_m) < MATCH_M))
        too_far = math.hypot(delta[0], delta[1]) > MAX_SHIFT_M or abs(delta[2]) > MAX_TURN_RAD
        if self.match_ratio < MIN_MATCH_RATIO or too_far:
            return False
        track_origin = Pose2D(0.0, 0.0, 0.0).relative_to(self._track)
        self._map_from_track = _moved(pose, GAIN * delta).compose(track_origin)
        return True

    def _fit(self, points: Points, pivot: Points) -> NDArray[np.float64]:
        """Return the shift and turn about `pivot` that bring the points onto the map's walls."""
        delta = np.zeros(3)
        for _ in range(ITERATIONS):
            moved = _transformed(points, pivot, delta)
            distance_m, gradient = self._field.sample(moved)
            arm = moved - pivot - delta[:2]
            turn = gradient[:, 1] * arm[:, 0] - gradient[:, 0] * arm[:, 1]
            jacobian = np.column_stack((gradient, turn))
            weight = np.clip(1.0 - np.abs(distance_m) / INLIER_M, 0.0, 1.0)
            normal = jacobian.T @ (weight[:, None] * jacobian) + DAMPING * np.eye(3)
            delta -= np.linalg.solve(normal, jacobian.T @ (weight * distance_m))
        return delta

    def _points(self, range_m: NDArray[np.float32], stamps: NDArray[np.int64]) -> Points:
        """Return the scan's points in the dead-reckoned frame, each by the pose of its moment."""
        beams = np.flatnonzero((range_m > MIN_BEAM_M) & (range_m < MAX_BEAM_M))
        angles = np.radians(beams) + self._lidar.yaw_rad
        ranges = range_m[beams].astype(np.float64)
        x = self._lidar.x_m + ranges * np.cos(angles)
        y = self._lidar.y_m + ranges * np.sin(angles)
        track_x, track_y, yaw = self._tracks_at(stamps[beams])
        c, s = np.cos(yaw), np.sin(yaw)
        return np.column_stack((track_x + c * x - s * y, track_y + s * x + c * y))

    def _on_map(self, points: Points) -> Points:
        frame = self._map_from_track
        c, s = math.cos(frame.yaw_rad), math.sin(frame.yaw_rad)
        on_map: Points = points @ np.array([[c, s], [-s, c]]) + (frame.x_m, frame.y_m)
        return on_map

    def _remember(self, stamp_ns: int) -> None:
        self._history.append((stamp_ns, self._track))
        while self._history[0][0] < stamp_ns - HISTORY_NS:
            self._history.popleft()

    def _track_at(self, stamp_ns: int) -> Pose2D:
        x, y, yaw = self._tracks_at(np.array([stamp_ns], dtype=np.int64))
        return Pose2D(float(x[0]), float(y[0]), wrap_angle(float(yaw[0])))

    def _tracks_at(self, stamps_ns: NDArray[np.int64]) -> tuple[Points, Points, Points]:
        history = self._history or [(0, self._track)]
        known_ns = np.array([stamp for stamp, _ in history], dtype=np.int64)
        since_s = (stamps_ns - known_ns[0]).astype(np.float64)
        known_s = (known_ns - known_ns[0]).astype(np.float64)
        yaw = np.unwrap([pose.yaw_rad for _, pose in history])
        return (
            np.interp(since_s, known_s, [pose.x_m for _, pose in history]),
            np.interp(since_s, known_s, [pose.y_m for _, pose in history]),
            np.interp(since_s, known_s, yaw),
        )


def _transformed(points: Points, pivot: Points, delta: NDArray[np.float64]) -> Points:
    c, s = math.cos(delta[2]), math.sin(delta[2])
    turned: Points = (points - pivot) @ np.array([[c, s], [-s, c]])
    return turned + pivot + delta[:2]


def _moved(pose: Pose2D, delta: NDArray[np.float64]) -> Pose2D:
    return Pose2D(
        pose.x_m + float(delta[0]),
        pose.y_m + float(delta[1]),
        wrap_angle(pose.yaw_rad + float(delta[2])),
    )
