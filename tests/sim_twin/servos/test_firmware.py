from math import pi
from typing import Any

import numpy as np

from drivers.dynamixel.wire.codec import Instruction
from sim_twin.servos import EmulatedServoSpec, ServoBank

CENTRE = 2048


def test_losing_the_supply_silences_the_bus_and_comes_back_without_torque(bench: Any) -> None:
    bench.arm()
    bench.write("goal_position", CENTRE + 100)
    bench.supply_v = 0.0
    bench.run(0.01)
    assert bench.duty[0] == 0.0
    assert bench.send(1, Instruction.PING) == []
    bench.supply_v = 12.0
    bench.run(0.1)
    assert bench.send(1, Instruction.PING) == []
    bench.run(0.15)
    assert bench.read("torque_enable") == 0
    assert bench.read("goal_position") == bench.read("present_position")


def test_a_reboot_answers_then_is_silent_for_its_boot_time(bench: Any) -> None:
    bench.arm()
    assert bench.send(1, Instruction.REBOOT)[0].error == 0
    bench.run(0.19)
    assert bench.send(1, Instruction.PING) == []
    assert bench.duty[0] == 0.0
    bench.run(0.02)
    assert len(bench.send(1, Instruction.PING)) == 1
    assert bench.read("torque_enable") == 0


def test_startup_configuration_can_switch_torque_on(bench: Any) -> None:
    bench.write("startup_configuration", 1)
    bench.send(1, Instruction.REBOOT)
    bench.run(0.3)
    assert bench.read("torque_enable") == 1


def test_servos_wake_up_where_they_are_and_count_from_the_first_turn() -> None:
    bank = ServoBank([EmulatedServoSpec(id=1, model_name="XM430-W350")])
    bank.advance(10**15, np.array([[2 * pi + 1.0], [0.0]]), np.zeros(1))
    expected = CENTRE + round(1.0 / (2 * pi) * 4096)
    assert bank.register(1, "present_position") == expected
    assert bank.register(1, "goal_position") == expected
    assert bank.register(1, "hardware_error_status") == 0
