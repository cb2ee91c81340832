"""Localisation in a drawn L-shaped flat; scans are traced on the true outline, not on the map."""

import math

import numpy as np
import pytest
from numpy.typing import NDArray

from vla_deploy.navigation.grid_map import GridMap
from vla_deploy.navigation.localisation import DistanceField, Localiser, Pose2D

# Axis-parallel solid boxes: x0, y0, x1, y1 in metres.
SOLIDS = np.array(
    [
        (-0.1, -0.1, 6.1, 0.0),
        (-0.1, 5.0, 6.1, 5.1),
        (-0.1, 0.0, 0.0, 5.0),
        (6.0, 0.0, 6.1, 5.0),
        (3.0, 0.0, 3.1, 2.0),
        (4.4, 3.6, 5.2, 4.4),
    ]
)
RESOLUTION_M = 0.05


def flat_map() -> GridMap:
    blocked = np.zeros((110, 130), dtype=np.bool_)
    origin = (-0.25, -0.25)
    for box in SOLIDS:
        x0, y0, x1, y1 = np.rint((box - np.tile(origin, 2)) / RESOLUTION_M).astype(int)
        blocked[y0:y1, x0:x1] = True
    return GridMap(resolution_m=RESOLUTION_M, origin_m=origin, blocked=blocked)


def trace(pose: Pose2D, solids: NDArray[np.float64] = SOLIDS) -> NDArray[np.float32]:
    """Cast 360 beams by the slab method."""
    angles = pose.yaw_rad + np.radians(np.arange(360))
    direction = np.column_stack((np.cos(angles), np.sin(angles)))
    direction[np.abs(direction) < 1e-9] = 1e-9
    start = np.array([pose.x_m, pose.y_m])
    low = (solids[None, :, :2] - start) / direction[:, None]
    high = (solids[None, :, 2:] - start) / direction[:, None]
    enter = np.minimum(low, high).max(axis=2)
    leave = np.maximum(low, high).min(axis=2)
    hit = np.where((enter < leave) & (enter > 0), enter, np.inf).min(axis=1)
    return np.where(np.isfinite(hit), hit, 0.0).astype(np.float32)


def still_scan(pose: Pose2D, seed: int = 0) -> NDArray[np.float32]:
    noise = np.random.default_rng(seed).normal(0.0, 0.005, 360)
    ranges = trace(pose)
    return np.where(ranges > 0, ranges + noise, 0.0).astype(np.float32)


def error_of(localiser: Localiser, truth: Pose2D) -> tuple[float, float]:
    off = localiser.pose.relative_to(truth)
    return math.hypot(off.x_m, off.y_m), abs(off.yaw_rad)


def test_the_field_is_zero_on_walls_and_negative_inside() -> None:
    field = DistanceField(flat_map())
    distance, gradient = field.sample(np.array([[0.0, 2.5], [1.0, 2.5], [3.05, 1.0], [3.3, 1.0]]))
    assert distance[0] == pytest.approx(0.0, abs=0.01)
    assert distance[1] == pytest.approx(1.0, abs=0.01)
    assert distance[2] < -0.02
    assert distance[3] == pytest.approx(0.2, abs=0.01)
    assert gradient[1] == pytest.approx([1.0, 0.0], abs=0.05)


@pytest.mark.parametrize("true", [Pose2D(1.5, 1.2, 0.4), Pose2D(4.6, 1.5, -2.2)])
def test_a_wrong_start_is_corrected_by_standing_still(true: Pose2D) -> None:
    start = true.compose(Pose2D(0.12, -0.1, 0.09))
    localiser = Localiser(start, flat_map())
    for step in range(20):
        localiser.predict(step * 100_000_000, Pose2D(0, 0, 0), 0.0)
        stamps = np.full(360, step * 100_000_000, dtype=np.int64)
        assert localiser.correct(still_scan(true, step), stamps)
    position_m, yaw_rad = error_of(localiser, true)
    assert position_m < 0.015
    assert yaw_rad < 0.006
    assert localiser.match_ratio > 0.9


def drive(*, correct: bool, seconds: float = 25.0) -> tuple[float, float]:
    """Drive a closed curve with wheels 8 % too long and a drifting IMU; return the final error."""
    localiser = Localiser(Pose2D(1.5, 1.5, 0.0), flat_map())
    true, odometry, imu_yaw = Pose2D(1.5, 1.5, 0.0), Pose2D(0.0, 0.0, 0.0), 0.0
    step_s, poses, stamps = 0.02, [], []
    for tick in range(round(seconds / step_s)):
        turn = 0.9 * math.sin(0.5 * tick * step_s) * step_s
        true = true.compose(Pose2D(0.18 * step_s, 0.0, turn))
        odometry = odometry.compose(Pose2D(0.18 * 1.08 * step_s, 0.0, turn * 0.97))
        imu_yaw += turn + 0.002 * step_s
        now_ns = tick * 20_000_000
        poses.append(true)
        stamps.append(now_ns)
        localiser.predict(now_ns, odometry, imu_yaw)
        if correct and tick % 5 == 4:
            # The lidar turns clockwise while the robot moves: each fifth sees another pose.
            ranges, beam_stamps = np.zeros(360, np.float32), np.zeros(360, np.int64)
            for part in range(5):
                beams = np.arange(360)[(4 - part) * 72 : (5 - part) * 72]
                ranges[beams] = trace(poses[part - 5])[beams]
                beam_stamps[beams] = stamps[part - 5]
            localiser.correct(ranges, beam_stamps)
    return error_of(localiser, true)


def test_scans_take_out_the_drift_of_wheels_and_imu() -> None:
    drifted_m, drifted_rad = drive(correct=False)
    assert drifted_m > 0.1
    assert drifted_rad > 0.04
    position_m, yaw_rad = drive(correct=True)
    assert position_m < 0.03
    assert yaw_rad < 0.01


def test_a_scan_that_does_not_fit_moves_nothing() -> None:
    localiser = Localiser(Pose2D(1.5, 1.5, 0.0), flat_map())
    localiser.predict(0, Pose2D(0, 0, 0), 0.0)
    crowd = np.full(360, 0.6, dtype=np.float32)
    assert not localiser.correct(crowd, np.zeros(360, dtype=np.int64))
    assert localiser.pose == Pose2D(1.5, 1.5, 0.0)
    assert localiser.match_ratio < 0.2


def test_an_empty_scan_moves_nothing() -> None:
    localiser = Localiser(Pose2D(1.5, 1.5, 0.0), flat_map())
    assert not localiser.correct(np.zeros(360, np.float32), np.zeros(360, np.int64))
    assert localiser.pose == Pose2D(1.5, 1.5, 0.0)


def test_odometry_that_starts_anew_does_not_move_the_robot() -> None:
    localiser = Localiser(Pose2D(1.0, 2.0, 0.5), flat_map())
    localiser.predict(0, Pose2D(3.0, 1.0, 0.2), None)
    localiser.predict(1, Pose2D(3.1, 1.0, 0.2), None)
    moved = localiser.pose
    localiser.predict(2, Pose2D(0.0, 0.0, 0.2), None)
    assert localiser.pose == moved


def test_past_poses_are_interpolated() -> None:
    localiser = Localiser(Pose2D(1.0, 1.0, 0.0), flat_map())
    localiser.predict(0, Pose2D(0.0, 0.0, 0.0), 3.1)
    localiser.predict(100, Pose2D(0.1, 0.0, 0.0), -3.1)
    middle = localiser.pose_at(50)
    assert middle.x_m == pytest.approx(1.05)
    assert middle.yaw_rad == pytest.approx((2 * math.pi - 6.2) / 2)
    assert localiser.pose_at(-5).x_m == 1.0
    assert localiser.pose_at(500) == localiser.pose
