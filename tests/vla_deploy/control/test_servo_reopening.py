"""Open a lost servo line again beside the ticks, where time on the wire counts."""

from collections.abc import Iterator
from pathlib import Path

import pytest

from drivers.clock import NS_PER_S
from platforms import load_profile
from sim_twin.harness.lockstep import Lockstep
from sim_twin.servos import WireTiming
from vla_deploy.control.output.servos import REOPEN_NS, ServoLine
from vla_deploy.robots import load_robot

ROBOT = load_robot("butler")


@pytest.fixture
def lockstep(tmp_path: Path) -> Iterator[Lockstep]:
    world = Lockstep(tmp_path=tmp_path, servo_timing=WireTiming(baud=ROBOT.servo_bus.baud))
    yield world
    world.close()


def lost_line(lockstep: Lockstep) -> ServoLine:
    line = ServoLine(ROBOT, load_profile("desktop"), lockstep.devices, lockstep.clock)
    line.open()
    fault = lockstep.faults.inject("servo_bus", None, "unplug")
    line.read()
    assert line.lost
    fault.clear()
    return line


def attempt(lockstep: Lockstep, line: ServoLine) -> tuple[bool, float]:
    """Return whether the next attempt succeeded, and how long it held its caller up."""
    lockstep.run_for(REOPEN_NS / NS_PER_S)
    before_ns = lockstep.clock.now_ns()
    back = line.try_reopen()
    return back, (lockstep.clock.now_ns() - before_ns) / NS_PER_S


def test_a_bus_without_power_holds_a_tick_up_for_a_tenth_of_a_second_at_most(
    lockstep: Lockstep,
) -> None:
    line = lost_line(lockstep)
    lockstep.faults.inject("servo_bus", None, "off")
    back, held_up_s = attempt(lockstep, line)
    assert not back
    assert "left_shoulder_yaw" in line.failure
    assert held_up_s < 0.1
    lockstep.faults.clear_all()
    assert attempt(lockstep, line)[0]


def test_one_servo_without_power_is_named_as_quickly(lockstep: Lockstep) -> None:
    line = lost_line(lockstep)
    lockstep.faults.inject("servo", "head_tilt", "off")
    back, held_up_s = attempt(lockstep, line)
    assert not back
    assert "head_tilt" in line.failure
    assert held_up_s < 0.15
