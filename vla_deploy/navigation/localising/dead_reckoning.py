"""Reckon the way from wheels and IMU, and place each beam of a scan where the base was then.

The dead-reckoned frame ("track") drifts smoothly and never jumps. What it is worth is told with
every step: wheels slip in proportion to the way, and an inertial sensor that freezes, jumps or
disagrees with the wheels is worth less.
"""

import math
from collections import deque
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from drivers.clock import NS_PER_S
from vla_deploy.robots.floor_pose import ORIGIN, Points, Pose2D, wrap_angle

Floats = NDArray[np.float64]

HISTORY_NS = 2 * NS_PER_S
SPEED_WINDOW_NS = NS_PER_S // 10
# Odometry that leaps begins anew, as when control restarts: the robot has not moved that far.
JUMP_M = 0.3
JUMP_RAD = 0.6
JUMP_SIGMA_M = 0.1
JUMP_SIGMA_RAD = 0.1
# Slip goes on for a while: its variance grows with the way as if each metre slipped by itself.
SLIP_RATIO = 0.05
SLIP_LENGTH_M = 0.3
WHEEL_TURN_RATIO = 0.06
IMU_TURN_RATIO = 0.01
IMU_NOISE_RAD2_S = 1e-6
# Nothing is known of a robot whose wheels are silent: somebody may push it.
SILENT_S = 0.2
SILENT_M2_S = 0.01
SILENT_RAD2_S = 0.01
# An inertial sensor that works never tells the same turn this often while the wheels turn.
FROZEN_SAMPLES = 10
FROZEN_TURN_RAD = 0.02


@dataclass(frozen=True, slots=True, kw_only=True)
class OdometryStep:
    """Hold one dead-reckoned step in the base's frame, and its variances."""

    motion: Pose2D
    duration_s: float
    along_m2: float
    across_m2: float
    turn_rad2: float
    by_imu: bool


class DeadReckoning:
    """Keep the dead-reckoned pose and its last two seconds."""

    def __init__(self) -> None:
        self.pose = ORIGIN
        self.jumps = 0
        self._odometry: Pose2D | None = None
        self._imu_yaw_rad: float | None = None
        self._stamp_ns: int | None = None
        self._same_yaws = 0
        self._turned_rad = 0.0
        self._history: deque[tuple[int, Pose2D]] = deque()

    @property
    def imu_is_frozen(self) -> bool:
        """Return whether the IMU kept to one yaw while the wheels turned the robot."""
        return self._same_yaws >= FROZEN_SAMPLES and abs(self._turned_rad) > FROZEN_TURN_RAD

    def move(self, stamp_ns: int, odometry: Pose2D, imu_yaw_rad: float | None) -> OdometryStep:
        """Move by what wheels (way) and IMU (turn) say since the last call; return the step.

        Without a usable IMU the wheels' turn is taken.
        """
        elapsed_ns = 0 if self._stamp_ns is None else max(0, stamp_ns - self._stamp_ns)
        wheels = odometry.relative_to(self._odometry or odometry)
        leapt = math.hypot(wheels.x_m, wheels.y_m) > JUMP_M or abs(wheels.yaw_rad) > JUMP_RAD
        if leapt or not all(map(math.isfinite, (wheels.x_m, wheels.y_m, wheels.yaw_rad))):
            self.jumps += 1
            leapt, wheels = True, ORIGIN
        was_frozen = self.imu_is_frozen
        turn_rad = self._imu_turn(imu_yaw_rad, wheels.yaw_rad)
        if self.imu_is_frozen and not was_frozen:
            # Make up for the turn that was missed until it was noticed.
            wheels = Pose2D(wheels.x_m, wheels.y_m, wrap_angle(self._turned_rad))
        step = _step(wheels, turn_rad, elapsed_ns / NS_PER_S, leapt)
        if all(map(math.isfinite, (odometry.x_m, odometry.y_m, odometry.yaw_rad))):
            self._odometry = odometry
        self._stamp_ns = stamp_ns
        self.pose = self.pose.compose(step.motion)
        self._remember(stamp_ns)
        return step

    def at(self, stamp_ns: int) -> Pose2D:
        """Return where the base was; the nearest known moment where `stamp_ns` is out of range."""
        if not self._history:
            return self.pose
        x_m, y_m, yaw_rad = self.at_each(np.array([stamp_ns], dtype=np.int64))
        return Pose2D(float(x_m[0]), float(y_m[0]), wrap_angle(float(yaw_rad[0])))

    def at_each(self, stamps_ns: NDArray[np.int64]) -> tuple[Floats, Floats, Floats]:
        """Return x, y and unwrapped yaw of the base at many moments."""
        history = self._history or [(0, self.pose)]
        start_ns = history[0][0]
        known_s = np.array([stamp - start_ns for stamp, _ in history], dtype=np.float64)
        since_s = (stamps_ns - start_ns).astype(np.float64)
        yaw = np.unwrap([pose.yaw_rad for _, pose in history])
        return (
            np.interp(since_s, known_s, [pose.x_m for _, pose in history]),
            np.interp(since_s, known_s, [pose.y_m for _, pose in history]),
            np.interp(since_s, known_s, yaw),
        )

    def speed(self) -> tuple[float, float]:
        """Return how fast the base has just moved (m/s) and turned (rad/s), without signs."""
        if not self._history:
            return 0.0, 0.0
        now_ns = self._history[-1][0]
        before = self.at(now_ns - SPEED_WINDOW_NS)
        window_s = SPEED_WINDOW_NS / NS_PER_S
        return self.pose.distance_m(before) / window_s, self.pose.turn_rad(before) / window_s

    def place(self, local: Points, stamps_ns: NDArray[np.int64]) -> Points:
        """Return (n, 2) points of the base's frame in the track, each by the pose of its moment."""
        x_m, y_m, yaw_rad = self.at_each(stamps_ns)
        c, s = np.cos(yaw_rad), np.sin(yaw_rad)
        x, y = local.T
        return np.column_stack((x_m + c * x - s * y, y_m + s * x + c * y))

    def _imu_turn(self, yaw_rad: float | None, wheel_turn_rad: float) -> float | None:
        """Return the turn that the IMU tells, None where it tells none that can be true."""
        before, self._imu_yaw_rad = self._imu_yaw_rad, yaw_rad
        if yaw_rad is None or before is None or not math.isfinite(yaw_rad - before):
            self._same_yaws, self._turned_rad = 0, 0.0
            return None
        if yaw_rad == before:
            self._same_yaws += 1
            self._turned_rad += wheel_turn_rad
        else:
            self._same_yaws, self._turned_rad = 0, 0.0
        turn_rad = wrap_angle(yaw_rad - before)
        # A sensor that starts anew leaps back to zero.
        return None if self.imu_is_frozen or abs(turn_rad) > JUMP_RAD else turn_rad

    def _remember(self, stamp_ns: int) -> None:
        history = self._history
        if history and stamp_ns <= history[-1][0]:
            history.pop()
        history.append((stamp_ns, self.pose))
        while stamp_ns - history[0][0] > HISTORY_NS:
            history.popleft()


def _step(
    wheels: Pose2D, imu_turn_rad: float | None, elapsed_s: float, leapt: bool
) -> OdometryStep:
    way_m = math.hypot(wheels.x_m, wheels.y_m)
    turn_rad = wheels.yaw_rad if imu_turn_rad is None else imu_turn_rad
    silent_s = elapsed_s if elapsed_s > SILENT_S else 0.0
    slip_m2 = SLIP_RATIO**2 * SLIP_LENGTH_M * way_m + SILENT_M2_S * silent_s
    leap_m2 = JUMP_SIGMA_M**2 if leapt else 0.0
    return OdometryStep(
        motion=Pose2D(wheels.x_m, wheels.y_m, turn_rad),
        duration_s=elapsed_s,
        along_m2=slip_m2 + leap_m2,
        across_m2=0.25 * slip_m2 + leap_m2,
        turn_rad2=_turn_variance(wheels.yaw_rad, imu_turn_rad, way_m, elapsed_s)
        + SILENT_RAD2_S * silent_s
        + (JUMP_SIGMA_RAD**2 if leapt and imu_turn_rad is None else 0.0),
        by_imu=imu_turn_rad is not None,
    )


def _turn_variance(
    wheel_turn_rad: float, imu_turn_rad: float | None, way_m: float, elapsed_s: float
) -> float:
    """Return how wrong a turn may be; where wheels and IMU disagree, as wrong as they differ."""
    slip_rad2 = WHEEL_TURN_RATIO**2 * abs(wheel_turn_rad) + 2e-4 * way_m
    if imu_turn_rad is None:
        return slip_rad2
    differ_rad = abs(wrap_angle(imu_turn_rad - wheel_turn_rad))
    beyond_rad = max(0.0, differ_rad - 0.2 * abs(wheel_turn_rad) - 0.01)
    return IMU_TURN_RATIO**2 * abs(imu_turn_rad) + IMU_NOISE_RAD2_S * elapsed_s + beyond_rad**2
