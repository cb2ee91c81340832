"""Hold that control verifies a stop by what it measures, and never what it did not measure."""

from typing import Any
from typing import Any as Rig  # the class in conftest.py, which no test can import

import pytest

from sim_twin.faults.request import parse_request

DRIVING = {"v_m_s": 0.4, "w_rad_s": 0.0}


def last_stop(rig: Rig) -> dict[str, Any]:
    stop: dict[str, Any] = rig.status["last_stop"]
    return stop


def fail(
    rig: Rig, component: str, fault: str, instance: str | None = None, lasts_s: float = 5.0
) -> None:
    named = {"instance": instance} if instance else {}
    raw = {"component": component, "fault": fault, "duration_s": lasts_s, **named}
    rig.lockstep.faults.inject_checked(parse_request(raw, rig.robot))


def test_a_stop_in_motion_is_in_progress_and_then_verified(armed: Rig) -> None:
    assert armed.status["last_stop"] is None
    armed.go(1, left_elbow=2.4)
    armed.drive(**DRIVING, seconds=0.8)
    armed.ask("estop", within_s=0.06)
    assert (last_stop(armed)["state"], last_stop(armed)["standstill_s"]) == ("in_progress", None)
    armed.run(0.9)
    stop = last_stop(armed)
    assert (stop["state"], stop["reason"]) == ("verified", "")
    assert (stop["cause"], stop["source"], stop["category"]) == ("estop", "test", 1)
    assert 0.06 < stop["standstill_s"] < stop["allowed_s"]
    armed.run(0.5)
    assert last_stop(armed) == {**stop, "age_s": last_stop(armed)["age_s"]}


@pytest.mark.parametrize(
    ("component", "fault", "instance", "reason"),
    [
        ("drive", "stuck", "left_wheel", "left_wheel still moved at"),
        ("can_bus", "unplug", None, "wheels are not measured"),
        ("servo", "wrong_baud", "left_elbow", "left_elbow is not measured"),
        ("servo_bus", "unplug", None, "is not measured"),
    ],
)
def test_a_stop_fails_by_a_part_that_moves_on_or_is_not_measured(
    armed: Rig, component: str, fault: str, instance: str | None, reason: str
) -> None:
    armed.drive(**DRIVING, seconds=0.5)
    armed.publish("estop")
    fail(armed, component, fault, instance)
    armed.run(1.7)
    stop = last_stop(armed)
    assert (stop["state"], stop["standstill_s"]) == ("failed", None)
    assert reason in stop["reason"]


def test_measurements_that_come_back_in_time_count(armed: Rig) -> None:
    armed.publish("estop")
    fail(armed, "servo", "wrong_baud", "left_elbow", lasts_s=0.5)
    armed.run(1.2)
    stop = last_stop(armed)
    assert (stop["state"], stop["standstill_s"] > 0.4) == ("verified", True), stop


def test_an_operators_stop_is_verified_while_armed_unless_a_motion_begins(armed: Rig) -> None:
    armed.go(1, left_elbow=2.4)
    armed.run(0.4)
    armed.send(kind="cancel", motion_id=1)
    armed.send(kind="rest", motion_id=0, source="cli-1")
    armed.run(0.8)
    stop = last_stop(armed)
    assert (stop["state"], stop["cause"], stop["source"]) == ("verified", "stop", "cli-1"), stop
    assert (stop["number"], stop["category"], armed.state) == (1, 2, "armed")
    armed.send(kind="rest", motion_id=0, source="cli-2")
    armed.go(2, left_elbow=1.4)
    armed.run(0.1)
    stop = last_stop(armed)
    assert (stop["number"], stop["state"]) == (2, "failed")
    assert "a new motion began" in stop["reason"]
