"""Voltages that do not fit a robot's supplies are named at the wire: by `servo scan`, by doctor."""

from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from drivers.clock import MonotonicClock
from drivers.serial_port import SerialPort
from sim_twin.servos import EmulatedServoSpec
from sim_twin.servos.server import FreeServos
from vla_deploy.doctor import FindingLevel, live_context
from vla_deploy.doctor.servos import servos_on_the_bus
from vla_deploy.robots import load_robot

from .conftest import Bus

KOCH = load_robot("koch_v1_1")
WRONG = "supply shoulder (12 V): servo 1 (shoulder_pan) has 7.0 V, expected 9.0..14.0 V; servo 2"


@pytest.fixture
def bus(tmp_path: Path) -> Iterator[Bus]:
    """The servos of a Koch v1.1, each at the voltage that it is made for."""
    specs = [EmulatedServoSpec(id=one.id, model_name=one.model) for one in KOCH.servo_bus.servos]
    bus = Bus(tmp_path / "koch", FreeServos(specs))
    yield bus
    bus.close()


def found(bus: Bus, models: Path) -> list[tuple[FindingLevel, str]]:
    robot = replace(KOCH, servo_bus=replace(KOCH.servo_bus, path=bus.port))
    findings = servos_on_the_bus(live_context(None, robot, models))
    return [(one.level, one.measured) for one in findings]


def test_scan_names_the_supply_that_gives_another_voltage(
    bus: Bus, vla: Callable[..., Any]
) -> None:
    scan = ("servo", "scan", "--robot", "koch_v1_1", "--port", bus.port, "--json")
    said = vla(*scan)
    assert (said.code, said.document["wrong_voltages"]) == (0, [])
    bus.free.supply_v = (5.0, 7.0)
    said = vla(*scan)
    assert said.code == 1
    assert WRONG in said.err


def test_doctor_names_it_and_leaves_a_bus_that_is_in_use_alone(bus: Bus, tmp_path: Path) -> None:
    as_declared = "6 of 6 at 1000000 baud, 5.0 V to 12.0 V as declared"
    assert found(bus, tmp_path) == [(FindingLevel.OK, as_declared)]
    port = SerialPort(Path(bus.port), 1_000_000, MonotonicClock())
    ((level, measured),) = found(bus, tmp_path)
    port.close()
    assert level is FindingLevel.MISSING
    assert "the process that holds it" in measured
    bus.free.supply_v = (5.0, 7.0)
    ((level, measured),) = found(bus, tmp_path)
    assert level is FindingLevel.FAIL
    assert WRONG in measured
