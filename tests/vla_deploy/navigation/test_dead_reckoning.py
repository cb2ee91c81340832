import math

import numpy as np
import pytest

from vla_deploy.navigation.localising.dead_reckoning import (
    FROZEN_SAMPLES,
    DeadReckoning,
    OdometryStep,
)
from vla_deploy.robots.floor_pose import ORIGIN, Pose2D

TICK_NS = 20_000_000


def turning(
    imu_yaws: list[float | None], rate_rad: float = 0.02
) -> tuple[DeadReckoning, OdometryStep]:
    """Turn on the spot, the wheels telling `rate_rad` a step; return the reckoning, last step."""
    reckoning = DeadReckoning()
    step = reckoning.move(0, ORIGIN, imu_yaws[0])
    for number, yaw_rad in enumerate(imu_yaws[1:], start=1):
        odometry = Pose2D(0.0, 0.0, number * rate_rad)
        step = reckoning.move(number * TICK_NS, odometry, yaw_rad)
    return reckoning, step


def test_the_imu_tells_the_turn_and_the_wheels_where_it_is_away() -> None:
    by_imu, _ = turning([0.0, 0.03, 0.06])
    by_wheels, step = turning([None, None, None])
    assert by_imu.pose.yaw_rad == pytest.approx(0.06)
    assert by_wheels.pose.yaw_rad == pytest.approx(0.04)
    assert not step.by_imu


def test_a_frozen_imu_is_noticed_and_the_turn_that_it_hid_is_made_up_for() -> None:
    count = FROZEN_SAMPLES + 6
    reckoning, step = turning([0.5] * count)
    assert reckoning.imu_is_frozen
    assert not step.by_imu
    assert reckoning.pose.yaw_rad == pytest.approx(0.02 * (count - 1))


def test_an_imu_that_keeps_its_yaw_at_rest_is_not_frozen() -> None:
    reckoning, _ = turning([0.5] * 40, rate_rad=0.0)
    assert not reckoning.imu_is_frozen


def test_an_imu_that_starts_anew_does_not_turn_the_robot() -> None:
    reckoning, _ = turning([2.0, 2.02, 0.0, 0.02])
    assert reckoning.pose.yaw_rad == pytest.approx(0.06)


@pytest.mark.parametrize("leap", [Pose2D(5.0, 0.0, 0.0), Pose2D(0.0, 0.0, 2.0)])
def test_odometry_that_leaps_moves_nothing_and_is_doubted(leap: Pose2D) -> None:
    reckoning = DeadReckoning()
    reckoning.move(0, ORIGIN, None)
    step = reckoning.move(TICK_NS, leap, None)
    assert reckoning.pose == ORIGIN
    assert reckoning.jumps == 1
    assert step.along_m2 > 0.05**2
    after = reckoning.move(2 * TICK_NS, leap.compose(Pose2D(0.01, 0.0, 0.0)), None)
    assert after.motion.x_m == pytest.approx(0.01)


def test_odometry_that_is_no_number_moves_nothing() -> None:
    reckoning = DeadReckoning()
    reckoning.move(0, ORIGIN, None)
    reckoning.move(TICK_NS, Pose2D(math.nan, 0.0, 0.0), None)
    reckoning.move(2 * TICK_NS, Pose2D(0.02, 0.0, 0.0), None)
    assert reckoning.pose == Pose2D(0.02, 0.0, 0.0)


def test_slip_is_allowed_for_in_proportion_to_the_way_and_silence_to_the_time() -> None:
    reckoning = DeadReckoning()
    reckoning.move(0, ORIGIN, None)
    short = reckoning.move(TICK_NS, Pose2D(0.01, 0.0, 0.0), None)
    long = reckoning.move(2 * TICK_NS, Pose2D(0.03, 0.0, 0.0), None)
    silent = reckoning.move(60 * TICK_NS, Pose2D(0.03, 0.0, 0.0), None)
    assert long.along_m2 == pytest.approx(2 * short.along_m2)
    assert silent.along_m2 > 0.05**2


def test_each_beam_is_placed_by_the_pose_of_its_moment() -> None:
    reckoning = DeadReckoning()
    reckoning.move(0, ORIGIN, None)
    reckoning.move(TICK_NS, Pose2D(0.1, 0.0, 0.0), None)
    stamps = np.array([0, TICK_NS // 2, TICK_NS], dtype=np.int64)
    placed = reckoning.place(np.tile((1.0, 0.0), (3, 1)), stamps)
    assert placed[:, 0] == pytest.approx([1.0, 1.05, 1.1])
