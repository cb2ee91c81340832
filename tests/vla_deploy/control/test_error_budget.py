"""A servo that answers too rarely is lost, though it is never silent for long."""

from typing import Any

ELBOW = "left_elbow"


def test_a_servo_that_misses_every_third_answer_stops_the_robot(armed: Any) -> None:
    rhythm = {"of": "off", "period_s": 0.012, "duty_ratio": 0.34}
    fault = armed.lockstep.faults.inject("servo", ELBOW, "intermittent", **rhythm)
    assert armed.lockstep.run_until(lambda: armed.state == "stopped", 2.0), armed.status
    status = armed.status
    assert status["cause"] == "servo_bus_lost"
    assert f"{ELBOW}: too many answers missing or damaged" in status["detail"]
    assert status["buses"]["servos"]["budget"]["lost"] == [ELBOW]
    assert status["buses"]["servos"]["budget"]["bus"] != "lost"

    fault.clear()
    armed.ask("reset", within_s=2.0)
    assert armed.state == "disarmed", armed.status
    armed.ask("arm", within_s=1.0)
    assert armed.state == "armed", armed.status


def test_a_servo_that_misses_an_answer_now_and_then_is_told_and_goes_on(armed: Any) -> None:
    servo = armed.robot.servo_bus.servos[armed.robot.joint_index[ELBOW]]
    armed.lockstep.twin.servos.drop_ratio(servo.id, 0.04, seed=1)
    armed.run(1.0)
    assert armed.state == "armed", armed.status
    assert armed.status["buses"]["servos"]["budget"]["degraded"] == [ELBOW]
