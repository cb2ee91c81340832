"""Estimate the pose on the map by an extended Kalman filter: dead-reckoned steps, scan matches.

The state is x, y, yaw and the rate at which the IMU's yaw drifts.
"""

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

from vla_deploy.navigation.localising.dead_reckoning import DeadReckoning
from vla_deploy.robots.floor_pose import ORIGIN, Pose2D, wrap_angle

Floats = NDArray[np.float64]

START_SIGMA_M: Final = 0.15
START_SIGMA_RAD: Final = 0.10
DRIFT_SIGMA_RAD_S: Final = math.radians(1.0) / 60.0
DRIFT_WALK_RAD2_S3: Final = 1e-9
MOST_DRIFT_RAD_S: Final = math.radians(6.0)
# Chi-squared of three degrees of freedom: one right match in a hundred thousand is beyond it.
GATE: Final = 26.0


class PoseFilter:
    """Hold the estimate and its covariance, and the dead-reckoned track that carries it on."""

    def __init__(self, pose: Pose2D) -> None:
        self.pose = pose
        self.track = DeadReckoning()
        self.drift_rad_s = 0.0
        self._p = np.diag((START_SIGMA_M**2, START_SIGMA_M**2, START_SIGMA_RAD**2, 0.0))
        self._p[3, 3] = DRIFT_SIGMA_RAD_S**2

    @property
    def covariance(self) -> Floats:
        """Return the covariance of x, y and yaw, (3, 3) in the map frame."""
        return self._p[:3, :3].copy()

    @property
    def sigma_m(self) -> float:
        """Return the standard deviation of the position along its worst direction."""
        return math.sqrt(max(0.0, float(np.linalg.eigvalsh(self._p[:2, :2])[-1])))

    @property
    def sigma_rad(self) -> float:
        """Return the standard deviation of the heading."""
        return math.sqrt(max(0.0, float(self._p[2, 2])))

    @property
    def map_from_track(self) -> Pose2D:
        """Return where the dead-reckoned frame lies on the map now."""
        return self.pose.compose(ORIGIN.relative_to(self.track.pose))

    def pose_at(self, stamp_ns: int) -> Pose2D:
        """Return where the base was; the nearest known moment where `stamp_ns` is out of range."""
        return self.map_from_track.compose(self.track.at(stamp_ns))

    def predict(self, stamp_ns: int, odometry: Pose2D, imu_yaw_rad: float | None) -> None:
        """Move by what wheels (way) and IMU (turn) say since the last call.

        Without an IMU the wheels' turn is taken.
        """
        step = self.track.move(stamp_ns, odometry, imu_yaw_rad)
        drift_rad = self.drift_rad_s * step.duration_s if step.by_imu else 0.0
        motion = Pose2D(step.motion.x_m, step.motion.y_m, step.motion.yaw_rad - drift_rad)
        before, self.pose = self.pose, self.pose.compose(motion)
        moved_x, moved_y = self.pose.x_m - before.x_m, self.pose.y_m - before.y_m
        transition = np.eye(4)
        transition[0, 2], transition[1, 2] = -moved_y, moved_x
        transition[2, 3] = -step.duration_s if step.by_imu else 0.0
        p = transition @ self._p @ transition.T
        c, s = math.cos(before.yaw_rad), math.sin(before.yaw_rad)
        turn = np.array([[c, -s], [s, c]])
        p[:2, :2] += turn @ np.diag((step.along_m2, step.across_m2)) @ turn.T
        p[2, 2] += step.turn_rad2
        p[3, 3] += DRIFT_WALK_RAD2_S3 * step.duration_s
        self._p = p

    def surprise(self, shift: Floats, noise: Floats) -> float:
        """Return the squared distance of a match from the estimate in units of what both allow."""
        return float(shift @ np.linalg.solve(self.covariance + noise, shift))

    def correct(self, shift: Floats, noise: Floats) -> None:
        """Take in a match that lies `shift` (x, y, yaw) off, with its covariance (3, 3)."""
        gain = np.linalg.solve(self.covariance + noise, self._p[:3, :]).T
        change = gain @ shift
        self.pose = Pose2D(
            self.pose.x_m + float(change[0]),
            self.pose.y_m + float(change[1]),
            wrap_angle(self.pose.yaw_rad + float(change[2])),
        )
        drift = self.drift_rad_s + float(change[3])
        self.drift_rad_s = min(max(drift, -MOST_DRIFT_RAD_S), MOST_DRIFT_RAD_S)
        keep = np.eye(4)
        keep[:, :3] -= gain
        # Joseph's form stays symmetric and positive.
        self._p = keep @ self._p @ keep.T + gain @ noise @ gain.T

    def doubt(self, shift: Floats) -> None:
        """Allow for an error as large as `shift`: matches keep saying so."""
        self._p[:3, :3] += np.outer(shift, shift) + np.diag(0.25 * shift**2)

    def start_anew(self, pose: Pose2D, covariance: Floats) -> None:
        """Forget the pose, not the IMU's drift."""
        self.pose = pose
        self._p[:3, :] = 0.0
        self._p[:, :3] = 0.0
        self._p[:3, :3] = covariance
