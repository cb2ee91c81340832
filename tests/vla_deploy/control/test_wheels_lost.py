"""Run control against the twin's wheel drives: when they drop out, and while their bus is away."""

from typing import Any as Rig  # the class in conftest.py, which no test can import

import can


def test_a_drive_that_somebody_else_disables_is_told_and_armed_again_by_hand(armed: Rig) -> None:
    wire = armed.lockstep.twin.can_wire

    def stranger(_frame: can.Message) -> None:
        """Hear nothing."""

    wire.attach(stranger)
    disable_voltage = can.Message(arbitration_id=0x201, is_extended_id=False, data=bytes(6))
    wire.send(disable_voltage, stranger)
    armed.run(0.1)
    assert armed.status["cause"] == "drive_fault"
    assert armed.state == "stopped"
    armed.ask("reset")
    armed.ask("arm")
    assert armed.state == "armed"


def test_no_tick_waits_for_a_can_bus_that_is_opened_again(armed: Rig) -> None:
    armed.lockstep.faults.inject("can_bus", None, "unplug")
    armed.run(0.2)
    ticks, start_s = armed.control._ticks.tick, armed.lockstep.now_s
    armed.run(3.0)
    passed = round((armed.lockstep.now_s - start_s) / armed.control.period_s)
    assert armed.control._ticks.tick - ticks == passed
    assert armed.column("age_s").max() < 0.01
