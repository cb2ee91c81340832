import math

import numpy as np
import pytest

from sim_twin.engine import Engine

EVERY_BEAM = np.arange(360)


def test_the_lidar_sees_the_wall_at_its_distance(engine: Engine) -> None:
    ranges = engine.lidar.cast(EVERY_BEAM)
    assert ranges.shape == (360,)
    assert ranges[0] == pytest.approx(2.0)
    assert ranges[30] == pytest.approx(2.0 / math.cos(math.radians(30)), rel=1e-5)


def test_a_few_beams_see_what_they_see_among_all(engine: Engine) -> None:
    few = np.array([350, 0, 30, 30])
    assert np.array_equal(engine.lidar.cast(few), engine.lidar.cast(EVERY_BEAM)[few])


def test_beams_count_counter_clockwise_from_the_front(engine: Engine) -> None:
    engine.place("base", 0.0, 0.0, 0.0, math.radians(-90))
    ranges = engine.lidar.cast(EVERY_BEAM)
    assert ranges[90] == pytest.approx(2.0)
    assert ranges[0] == 0.0


def test_the_lidar_passes_the_robot_itself_by(engine: Engine) -> None:
    assert np.count_nonzero(engine.lidar.cast(EVERY_BEAM) < 0.5) == np.count_nonzero(
        engine.lidar.cast(EVERY_BEAM) == 0
    )


def test_the_imu_feels_gravity_at_rest(engine: Engine) -> None:
    for _ in range(200):
        engine.step()
    force = engine.imu.read().acceleration_m_s2
    assert force == pytest.approx((0.0, 0.0, 9.81), abs=0.05)


def test_the_imu_reads_yaw(engine: Engine) -> None:
    engine.place("base", 0.0, 0.0, 0.0, 2.5)
    assert engine.imu.read().yaw_rad == pytest.approx(2.5)
