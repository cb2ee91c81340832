"""The robot's own button stops it within one tick; releasing it resets nothing."""

from typing import Any as Rig  # the class in conftest.py, which no test can import

import pytest

from drivers.errors import DeviceMissing
from sim_twin.ports.lines import MemoryLine


def press(rig: Rig) -> None:
    rig.lockstep.twin.estop_button.press()


def release(rig: Rig) -> None:
    rig.lockstep.twin.estop_button.release()


def plug(rig: Rig) -> Rig:
    return rig.lockstep.twin.plugs[rig.robot.estop.device]


def test_a_press_latches_the_emergency_stop_within_one_tick(armed: Rig) -> None:
    armed.go(1, speed_ratio=0.3, head_pan=0.8)
    armed.run(0.3)
    press(armed)
    armed.tick()
    assert armed.control._judging.state.estop_latched
    armed.run(0.03)
    assert armed.status["estop_latched"]
    assert armed.status["cause"] == "estop"
    assert "(button)" in armed.status["detail"]
    armed.run(2.5)
    assert armed.state == "stopped"
    assert armed.true_speeds().max() < 0.02


def test_releasing_the_button_resets_nothing_and_reset_needs_the_release(armed: Rig) -> None:
    press(armed)
    armed.run(2.5)
    armed.ask("reset", within_s=2.2)
    assert armed.status["estop_latched"]
    assert "reset refused" in armed.status["detail"]
    release(armed)
    armed.run(0.5)
    assert armed.state == "stopped"
    assert armed.status["estop_latched"]
    armed.ask("reset", within_s=2.2)
    assert armed.state == "disarmed"
    armed.ask("arm")
    assert armed.state == "armed"


def test_a_pressed_button_forbids_arming(rig: Rig) -> None:
    press(rig)
    rig.boot()
    rig.ask("arm")
    assert rig.state in ("stopping", "stopped")
    assert rig.status["estop_latched"]


def test_an_act_that_waits_when_the_button_is_pressed_is_dropped(armed: Rig) -> None:
    armed.ask("disarm", "arm", within_s=0.0)
    press(armed)
    armed.run(3.0)
    assert armed.state == "stopped"


def test_an_unplugged_button_stops_the_robot_and_recovers_without_a_restart(armed: Rig) -> None:
    plug(armed).pull()
    armed.tick()
    assert armed.control._judging.state.estop_latched
    armed.run(2.5)
    assert "button: " in armed.status["detail"]
    assert "plug" in armed.status["detail"]
    plug(armed).push()
    armed.run(4.0)
    armed.ask("reset", within_s=2.2)
    armed.ask("arm")
    assert armed.state == "armed"


def test_a_declared_button_that_is_missing_is_a_fault_of_the_set_up(rig: Rig) -> None:
    plug(rig).pull()
    with pytest.raises(DeviceMissing, match="estop"):
        rig.lockstep.add(rig.control)
    assert any(isinstance(line, MemoryLine) for line in rig.lockstep.devices.opened)
