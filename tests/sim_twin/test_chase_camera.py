import numpy as np
import pytest

from sim_twin.physics.engine import Engine
from sim_twin.pictures.chase_camera import ELEVATIONS_DEG, ChaseCamera

LOWEST_DEG = -ELEVATIONS_DEG[0]


def test_in_the_open_it_watches_from_the_front_right_and_low(engine: Engine) -> None:
    view = ChaseCamera(engine.model, engine.data).view
    assert (view.azimuth, view.elevation) == pytest.approx((125.0, LOWEST_DEG))


def test_a_wall_in_between_makes_it_change_sides(engine: Engine) -> None:
    engine.place("base", 1.6, 0.0, 0.0, np.pi / 2)
    camera = ChaseCamera(engine.model, engine.data)
    assert camera.view.azimuth % 360.0 == pytest.approx((90.0 - 125.0) % 360.0)
    assert camera.view.elevation == pytest.approx(LOWEST_DEG)


def test_a_wall_in_front_makes_it_watch_from_behind(engine: Engine) -> None:
    engine.place("base", 1.6, 0.0, 0.0, 0.0)
    view = ChaseCamera(engine.model, engine.data).view
    assert (view.azimuth, view.elevation) == pytest.approx((45.0, LOWEST_DEG))


def test_it_rises_to_look_over_a_low_wall_rather_than_go_behind(engine: Engine) -> None:
    engine.model.geom("wall").size[2] = engine.model.geom("wall").pos[2] = 0.6
    engine.place("base", 1.3, 0.0, 0.0, 0.0)
    view = ChaseCamera(engine.model, engine.data).view
    assert view.azimuth == pytest.approx(125.0)
    assert view.elevation < LOWEST_DEG


def test_it_follows_without_haste_and_arrives(engine: Engine) -> None:
    camera = ChaseCamera(engine.model, engine.data)
    engine.place("base", -1.0, 0.0, 0.0, 0.0)
    start_m = camera.view.lookat[0]
    assert camera.follow().lookat[0] == pytest.approx(start_m - 0.12)
    for _ in range(60):
        camera.follow()
    assert camera.view.lookat[0] == pytest.approx(start_m - 1.0, abs=0.01)
