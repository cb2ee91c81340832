import pytest

from sim_twin.errors import RefereeRefusal
from sim_twin.physics.engine import Engine


def settle(engine: Engine) -> None:
    for _ in range(300):
        engine.step()


def test_a_cup_at_rest_in_the_box_is_inside(engine: Engine) -> None:
    engine.place("cup", 0.02, 2.0, 0.045, 0.0)
    settle(engine)
    verdict = engine.referee.inside("cup", "box")
    assert verdict["inside"]
    assert verdict["placement_error_m"] == pytest.approx(0.02, abs=0.002)


def test_a_cup_next_to_the_box_is_not_inside(engine: Engine) -> None:
    engine.place("cup", 0.0, 1.8, 0.03, 0.0)
    settle(engine)
    assert not engine.referee.inside("cup", "box")["inside"]


def test_a_cup_above_the_rim_is_not_inside(engine: Engine) -> None:
    engine.place("cup", 0.0, 2.0, 0.4, 0.0)
    assert not engine.referee.inside("cup", "box")["within"]


def test_a_cup_that_still_falls_does_not_rest(engine: Engine) -> None:
    engine.place("cup", 0.0, 2.0, 0.25, 0.0)
    for _ in range(95):
        engine.step()
    verdict = engine.referee.inside("cup", "box")
    assert (verdict["within"], verdict["resting"], verdict["inside"]) == (True, False, False)


def test_a_cup_that_the_robot_touches_is_not_put_away(engine: Engine) -> None:
    engine.place("base", 0.0, 2.0, 0.1, 0.0)
    engine.place("cup", 0.0, 2.0, 0.33, 0.0)
    settle(engine)
    verdict = engine.referee.inside("cup", "box")
    assert verdict["touched_by_robot"]
    assert not verdict["inside"]


def test_a_cup_carried_by_the_robot_alone_is_held(engine: Engine) -> None:
    engine.place("cup", -0.1, 0.0, 0.235, 0.0)
    for _ in range(20):
        engine.step()
    assert engine.referee.truth()["held"] == ["cup"]


def test_the_truth_names_joints_and_objects(engine: Engine) -> None:
    truth = engine.referee.truth()
    assert set(truth["joints"]) == {"arm", "finger"}
    assert set(truth["objects"]) == {"cup"}
    assert truth["held"] == []


def test_an_unknown_object_is_refused_with_what_there_is(engine: Engine) -> None:
    with pytest.raises(RefereeRefusal, match="'spoon'; its objects are cup"):
        engine.referee.inside("spoon", "box")
