"""A stop ends when nothing moves, and within a bound when a wheel turns on."""

from typing import Any
from typing import Any as Rig  # the class in conftest.py, which no test can import

import pytest

from vla_deploy.control.modes.standstill import TURN_ON_NS, Standstill
from vla_deploy.control.output.wheels import Wheels


def test_rest_is_reached_at_once_where_the_wheels_stand() -> None:
    rest = Standstill()
    assert not rest.reached(0, setpoints_rest=False, wheels_still=True)
    assert rest.reached(1, setpoints_rest=True, wheels_still=True)


def test_wheels_that_turn_on_hold_rest_up_for_a_bounded_time() -> None:
    rest = Standstill()
    turning: dict[str, Any] = {"setpoints_rest": True, "wheels_still": False}
    assert not rest.reached(5, **turning)
    assert not rest.reached(5 + TURN_ON_NS - 1, **turning)
    assert rest.reached(5 + TURN_ON_NS, **turning)


def test_the_time_counts_anew_after_each_motion() -> None:
    rest = Standstill()
    assert not rest.reached(0, setpoints_rest=True, wheels_still=False)
    assert not rest.reached(TURN_ON_NS, setpoints_rest=False, wheels_still=False)
    assert not rest.reached(TURN_ON_NS + 1, setpoints_rest=True, wheels_still=False)


def test_a_wheel_that_creeps_on_does_not_keep_a_stop_from_ending(
    armed: Rig, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(Wheels, "still", property(lambda wheels: False))
    armed.ask("estop", within_s=0.2)
    assert armed.state in ("stopping", "stopped")
    armed.run(2.0)
    assert armed.state == "stopped"
    armed.ask("reset")
    assert armed.state == "disarmed", armed.status
