import math

import mujoco
import numpy as np
import pytest
from numpy.typing import NDArray

from sim_twin.physics.engine import Engine
from sim_twin.physics.load import load_engine
from vla_deploy.robots import load_robot

EVERY_BEAM = range(360)


@pytest.fixture(scope="module")
def flat() -> Engine:
    return load_engine(load_robot("butler"), "flat", seed=0)


def test_the_lidar_sees_the_wall_at_its_distance(engine: Engine) -> None:
    ranges = engine.lidar.cast(EVERY_BEAM)
    assert ranges.shape == (360,)
    assert ranges[0] == pytest.approx(2.0)
    assert ranges[30] == pytest.approx(2.0 / math.cos(math.radians(30)), rel=1e-5)


@pytest.mark.parametrize("count", [1, 2, 120, 180, 181, 359])
def test_a_run_of_beams_sees_what_it_sees_among_all(flat: Engine, count: int) -> None:
    every = flat.lidar.cast(EVERY_BEAM)
    for first in range(0, 360, 17):
        some = range(first, first + count)
        assert np.array_equal(flat.lidar.cast(some), every.take(some, mode="wrap"))


def test_beams_may_be_counted_from_before_the_front(flat: Engine) -> None:
    assert np.array_equal(flat.lidar.cast(range(-20, 20)), flat.lidar.cast(range(340, 380)))


def test_beams_count_counter_clockwise_from_the_front(engine: Engine) -> None:
    engine.place("base", 0.0, 0.0, 0.0, math.radians(-90))
    ranges = engine.lidar.cast(EVERY_BEAM)
    assert ranges[90] == pytest.approx(2.0)
    assert ranges[0] == 0.0


def test_the_lidar_passes_the_robot_itself_by(engine: Engine) -> None:
    assert np.count_nonzero(engine.lidar.cast(EVERY_BEAM) < 0.5) == np.count_nonzero(
        engine.lidar.cast(EVERY_BEAM) == 0
    )


@pytest.mark.parametrize("lean_rad", [0.0, 0.02, 0.3, 1.2])
def test_hiding_what_the_plane_misses_changes_no_range(lean_rad: float) -> None:
    engine = load_engine(load_robot("butler"), "flat", seed=0)
    half = lean_rad / 2.0
    engine.data.joint("base_free").qpos[3:7] = (math.cos(half), math.sin(half), 0.0, 0.0)
    mujoco.mj_forward(engine.model, engine.data)
    x_m, y_m, z_m = engine.data.site("lidar").xpos
    engine.place("red_cup", x_m + 0.5, y_m, z_m, 0.0)
    ranges = engine.lidar.cast(EVERY_BEAM)
    assert np.count_nonzero(ranges) > 180
    assert np.array_equal(ranges, _cast_at_everything(engine))


def _cast_at_everything(engine: Engine) -> NDArray[np.float32]:
    data = engine.data
    angles = np.radians(EVERY_BEAM)
    level = np.stack([np.cos(angles), np.sin(angles), 0.0 * angles], axis=1)
    rays = (level @ data.body("base").xmat.reshape(3, 3).T).ravel()
    geoms, ranges_m = np.zeros(360, np.int32), np.zeros(360)
    groups = np.array([1, 1, 0, 0, 0, 0], np.uint8)
    origin = data.site("lidar").xpos
    mujoco.mj_multiRay(
        engine.model, data, origin, rays, groups, True, -1, geoms, ranges_m, None, 360, 25.0
    )
    return np.where(geoms >= 0, ranges_m, 0.0).astype(np.float32)


def test_the_imu_feels_gravity_at_rest(engine: Engine) -> None:
    for _ in range(200):
        engine.step()
    force = engine.imu.read().acceleration_m_s2
    assert force == pytest.approx((0.0, 0.0, 9.81), abs=0.05)


def test_the_imu_reads_yaw(engine: Engine) -> None:
    engine.place("base", 0.0, 0.0, 0.0, 2.5)
    assert engine.imu.read().yaw_rad == pytest.approx(2.5)
