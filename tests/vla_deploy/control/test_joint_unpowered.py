"""A joint that lets go by itself stops the robot; power that is taken on purpose does not."""

from typing import Any as Rig  # the class in conftest.py, which no test can import

import pytest

ELBOW = "left_elbow"


def let_go(rig: Rig, joint: str) -> None:
    """Take a servo's torque behind control's back, over the wire."""
    servo = next(s for s in rig.robot.servo_bus.servos if s.joint == joint)
    rig.control._servos._bus.write_register(servo.id, "torque_enable", 0)


def test_a_joint_that_lets_go_holds_the_others_and_comes_back_by_reset_and_arm(armed: Rig) -> None:
    armed.drive(0.3, 0.0, 0.5)
    armed.go(1, head_pan=1.2)
    armed.run(0.3)
    let_go(armed, ELBOW)
    armed.drive(0.3, 0.0, 1.0)
    assert (armed.state, armed.status["cause"]) == ("stopped", "joint_unpowered")
    assert (armed.status["subject"], armed.status["measured"]) == (ELBOW, 1.0)
    assert [result["status"] for result in armed.results()] == ["stopped"]
    assert abs(armed.base()["v_m_s"]) < 0.01
    powered = dict(zip(armed.robot.joint_names, armed.column("torque_enabled"), strict=True))
    assert [joint for joint, on in powered.items() if not on] == [ELBOW]
    armed.ask("reset", "arm", within_s=1.0)
    assert armed.state == "armed", armed.status
    assert armed.column("torque_enabled").all()


@pytest.mark.parametrize("act", ["disarm", "estop"])
def test_power_that_an_act_takes_is_not_missed(armed: Rig, act: str) -> None:
    armed.ask(act, within_s=1.0)
    assert armed.status["cause"] == ("estop" if act == "estop" else "")
    latched = {verdict.cause.value for verdict in armed.control._judging.state.latched}
    assert latched == ({"estop"} if act == "estop" else set())
    armed.ask("reset", "arm", within_s=1.0)
    assert armed.state == "armed", armed.status


def test_a_joint_that_lets_go_while_the_robot_pauses_ends_the_pause(armed: Rig) -> None:
    demand = {"rows": [], "stop": True, "reason": "memory"}
    armed.space.cell_writer("budget_stop").put_document(demand)
    armed.run(0.5)
    assert armed.state == "protective_stop"
    let_go(armed, ELBOW)
    armed.run(0.5)
    assert (armed.state, armed.status["cause"]) == ("stopped", "joint_unpowered")


def test_joints_that_wait_for_their_power_do_not_hold_up_arming(rig: Rig) -> None:
    rig.boot()
    causes = set()
    rig.ask("arm", within_s=0.0)
    for _ in range(60):
        rig.tick()
        causes.add(rig.status["cause"])
    assert (rig.state, causes) == ("armed", {""})
