"""Somebody takes and puts down things; the hand-over of a thing: tests/end_to_end."""

from collections.abc import Callable

import pytest

from sim_twin.errors import RefereeRefusal
from sim_twin.harness.lockstep import Lockstep

TABLE = {"x_m": 2.2, "y_m": 1.6, "z_m": 0.4975, "yaw_rad": 0.5}


def test_what_lies_about_is_taken_at_once_and_put_down_again(lockstep: Lockstep) -> None:
    person = lockstep.twin.person
    person.take("red_cup")
    assert (person.taken, person.pulls_at) == (("red_cup",), None)
    lockstep.run_for(0.5)
    assert "red_cup" not in person.document()["things"]
    far = lockstep.truth()["objects"]["red_cup"]
    assert far["position_m"][0] > 50.0
    assert far["speed_m_s"] < 0.05
    person.put("red_cup", TABLE)
    lockstep.run_for(0.3)
    assert person.taken == ()
    assert person.document()["things"]["red_cup"] == pytest.approx((2.2, 1.6, 0.4975), abs=0.01)


@pytest.mark.parametrize(
    ("act", "complaint"),
    [
        (lambda person: person.take("moon"), "no thing 'moon'; there are box, red_cup"),
        (lambda person: person.put("moon", TABLE), "no thing 'moon'"),
        (lambda person: person.put("book", {**TABLE, "x_m": float("nan")}), "within 50"),
        (lambda person: person.put("book", {**TABLE, "z_m": 51.0}), "within 50"),
        (lambda person: person.put("book", {"x_m": 1.0}), "expected x_m, y_m, z_m and yaw_rad"),
        (lambda person: [person.take("book") for _ in range(2)], "has the book already"),
    ],
)
def test_what_cannot_be_is_refused_by_name(
    lockstep: Lockstep, act: Callable[..., object], complaint: str
) -> None:
    with pytest.raises(RefereeRefusal, match=complaint):
        act(lockstep.twin.person)
