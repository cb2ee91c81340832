"""Follow a path with a differential drive: turn towards it, track it, turn to the final heading.

A lidar scan says whether something stands in the strip of floor that the body is about to sweep.
"""

import math
from dataclasses import dataclass
from enum import Enum

import numpy as np
from numpy.typing import NDArray

from vla_deploy.robots.floor_pose import Points, wrap_angle


@dataclass(frozen=True, slots=True, kw_only=True)
class DriveLimits:
    """Bound what the follower asks of the base."""

    speed_m_s: float
    turn_rate_rad_s: float
    acceleration_m_s2: float
    turn_acceleration_rad_s2: float


@dataclass(frozen=True, slots=True)
class Twist:
    """Ask for a base velocity: forward, and counter-clockwise."""

    v_m_s: float
    w_rad_s: float


AT_REST = Twist(0.0, 0.0)
LOOK_AHEAD_M = 0.35
POSITION_TOLERANCE_M = 0.02
YAW_TOLERANCE_RAD = 0.02
TURN_FIRST_RAD = 0.5
TRACK_RAD = 0.15
HEADING_GAIN_1_S = 2.5
# Below this rate the drives' friction wins over a proportional command.
MIN_TURN_RATE_RAD_S = 0.06
MIN_SPEED_M_S = 0.02
SIDE_MARGIN_M = 0.04
# The path keeps clear of what the map shows; of that, only imminent contact counts.
MAPPED_REACH_M = 0.05


class FollowerPhase(Enum):
    """Name what the follower is doing."""

    ALIGN = "align"
    TRACK = "track"
    FINAL_TURN = "final turn"
    ARRIVED = "arrived"


class PathFollower:
    """Turn poses into velocities until the path's end; `points` is (n, 2) in the pose's frame."""

    def __init__(
        self, points: NDArray[np.float64], limits: DriveLimits, final_yaw_rad: float | None = None
    ) -> None:
        self._points = points
        self._limits = limits
        self._final_yaw_rad = final_yaw_rad
        self._segment = 0
        self.phase = FollowerPhase.ALIGN

    def take_up(self, points: NDArray[np.float64]) -> None:
        """Follow another path from here, without a halt where the base moves along it already."""
        self._points, self._segment = points, 0
        if self.phase is not FollowerPhase.TRACK:
            self.phase = FollowerPhase.ALIGN

    def step(self, x_m: float, y_m: float, yaw_rad: float) -> Twist:
        """Return the velocity for this moment; at rest once `phase` is ARRIVED."""
        position = np.array((x_m, y_m))
        remaining_m = self._remaining(position)
        if self.phase in (FollowerPhase.ALIGN, FollowerPhase.TRACK) and self._at_end(position):
            self.phase = FollowerPhase.FINAL_TURN
        if self.phase in (FollowerPhase.ALIGN, FollowerPhase.TRACK):
            target = self._look_ahead(position)
            bearing_rad = math.atan2(target[1] - y_m, target[0] - x_m)
            return self._towards(wrap_angle(bearing_rad - yaw_rad), remaining_m)
        return self._final_turn(yaw_rad)

    def _towards(self, error_rad: float, remaining_m: float) -> Twist:
        if abs(error_rad) > TURN_FIRST_RAD:
            self.phase = FollowerPhase.ALIGN
        elif abs(error_rad) < TRACK_RAD:
            self.phase = FollowerPhase.TRACK
        turn = self._turn_rate(error_rad)
        if self.phase is FollowerPhase.ALIGN:
            return Twist(0.0, turn)
        braking_m_s = math.sqrt(max(0.0, 1.2 * self._limits.acceleration_m_s2 * remaining_m))
        speed = min(self._limits.speed_m_s, braking_m_s) * max(0.0, math.cos(2.0 * error_rad))
        return Twist(max(speed, MIN_SPEED_M_S), turn)

    def _final_turn(self, yaw_rad: float) -> Twist:
        if self._final_yaw_rad is None:
            self.phase = FollowerPhase.ARRIVED
            return AT_REST
        error_rad = wrap_angle(self._final_yaw_rad - yaw_rad)
        if abs(error_rad) < YAW_TOLERANCE_RAD:
            self.phase = FollowerPhase.ARRIVED
            return AT_REST
        return Twist(0.0, self._turn_rate(error_rad))

    def _turn_rate(self, error_rad: float) -> float:
        braking_rad_s = math.sqrt(1.2 * self._limits.turn_acceleration_rad_s2 * abs(error_rad))
        rate = min(self._limits.turn_rate_rad_s, braking_rad_s, HEADING_GAIN_1_S * abs(error_rad))
        return math.copysign(max(rate, MIN_TURN_RATE_RAD_S), error_rad)

    def _at_end(self, position: NDArray[np.float64]) -> bool:
        """Return whether the end is reached, or was just passed."""
        to_end = self._points[-1] - position
        distance_m = float(np.linalg.norm(to_end))
        if distance_m < POSITION_TOLERANCE_M:
            return True
        if self._segment < len(self._points) - 2 or len(self._points) < 2:
            return False
        along = self._points[-1] - self._points[-2]
        return distance_m < 5 * POSITION_TOLERANCE_M and float(to_end @ along) <= 0.0

    def _remaining(self, position: NDArray[np.float64]) -> float:
        self._advance(position)
        ahead = self._points[self._segment + 1 :]
        legs = np.diff(np.vstack((position, ahead)), axis=0)
        return float(np.linalg.norm(legs, axis=1).sum())

    def _advance(self, position: NDArray[np.float64]) -> None:
        """Move on to the next segment once the projection has passed its end.

        Looking ahead cuts corners: a short segment at the beginning that was left aside is passed,
        too, once the one behind it is nearer.
        """
        while self._segment < len(self._points) - 2:
            start, end, following = self._points[self._segment : self._segment + 3]
            is_passed = float((position - end) @ (end - start)) >= 0.0
            begins = self._segment == 0 and float(np.linalg.norm(end - start)) < LOOK_AHEAD_M
            if not is_passed and begins:
                next_m = _away_m(position, end, following)
                is_passed = next_m < _away_m(position, start, end)
            if not is_passed:
                return
            self._segment += 1

    def _look_ahead(self, position: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the point LOOK_AHEAD_M along the path from the projection of `position`."""
        if len(self._points) < 2:
            return np.asarray(self._points[-1])
        start, end = self._points[self._segment], self._points[self._segment + 1]
        along = end - start
        length_m = float(np.linalg.norm(along)) or 1e-9
        travelled_m = float((position - start) @ along) / length_m
        left_m = min(max(travelled_m, 0.0), length_m) + LOOK_AHEAD_M
        for first, second in zip(
            self._points[self._segment :], self._points[self._segment + 1 :], strict=False
        ):
            leg_m = float(np.linalg.norm(second - first))
            if left_m <= leg_m:
                return np.asarray(first + (second - first) * (left_m / leg_m))
            left_m -= leg_m
        return np.asarray(self._points[-1])


def _away_m(point: Points, start: Points, end: Points) -> float:
    """Return how far a point is from a segment."""
    along = end - start
    share = float((point - start) @ along) / max(float(along @ along), 1e-12)
    return float(np.linalg.norm(point - start - min(max(share, 0.0), 1.0) * along))


def scan_points(ranges_m: NDArray[np.float64]) -> Points:
    """Return a scan's points in the base frame; beam i looks to i degrees, 0 m means no echo."""
    beams = np.flatnonzero(ranges_m > 0.0)
    angles = np.deg2rad(beams * (360.0 / len(ranges_m)))
    points: Points = ranges_m[beams, None] * np.column_stack((np.cos(angles), np.sin(angles)))
    return points


def is_blocked(
    points: Points, mapped: NDArray[np.bool_], *, reach_m: float, radius_m: float
) -> bool:
    """Return whether a body of that radius meets a point within `reach_m` ahead.

    `points` are (n, 2) with x along the motion; `mapped` marks those that the map shows too.
    """
    ahead, aside = points[:, 0], np.abs(points[:, 1])
    reach = np.where(mapped, min(reach_m, MAPPED_REACH_M), reach_m)
    half_width = radius_m + np.where(mapped, 0.0, SIDE_MARGIN_M)
    # The body is round: beside its middle its front lies further back.
    front = np.sqrt(np.maximum(0.0, half_width**2 - aside**2))
    return bool(((ahead > 0.0) & (aside < half_width) & (ahead < front + reach)).any())
