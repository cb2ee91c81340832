"""Servos of one bus that hang on different supplies: each line sags and fails on its own."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from drivers.dynamixel.tables.control_table import MODELS
from drivers.dynamixel.wire.codec import Instruction, encode_instruction
from drivers.feetech.codec import FeetechInstruction, encode_packet
from sim_twin.servos import EmulatedServoSpec, ServoBank
from sim_twin.servos.feetech import EmulatedFeetechSpec, FeetechBank
from sim_twin.servos.firmware.rail import Rails
from sim_twin.servos.wire_bank import WireBank

STEP_NS = 20_000_000
IDS = (1, 3)


class Powered:
    """Servos 1 and 3 at rest, whose supplies can be changed."""

    def __init__(self, bank: WireBank[Any], voltage: str, ping: Callable[[int], bytes]) -> None:
        self.bank, self.voltage, self.ping = bank, voltage, ping
        self.now_ns = 0

    def seen(self, *supply_v: float) -> list[tuple[int, bool]]:
        """Return tenths of a volt and whether it answers, of each servo, after a second."""
        for _ in range(50):
            self.now_ns += STEP_NS
            self.bank.advance(self.now_ns, np.zeros((2, 2)), np.zeros(2), supply_v)
        return [(self.bank.register(one, self.voltage), self._answers(one)) for one in IDS]

    def _answers(self, servo_id: int) -> bool:
        self.bank.receive(self.ping(servo_id))
        return bool(self.bank.transmit())


def dynamixels(feeds: tuple[int, ...]) -> Powered:
    names = zip(IDS, ("XL430-W250", "XL330-M288"), strict=True)
    specs = [EmulatedServoSpec(id=one, model_name=name) for one, name in names]
    return Powered(
        ServoBank(specs, feeds=feeds),
        "present_input_voltage",
        lambda one: encode_instruction(one, Instruction.PING, b""),
    )


def feetechs(feeds: tuple[int, ...]) -> Powered:
    names = zip(IDS, ("STS3215-C018", "SCS0009"), strict=True)
    specs = [EmulatedFeetechSpec(id=one, model_name=name) for one, name in names]
    return Powered(
        FeetechBank(specs, feeds=feeds),
        "present_voltage",
        lambda one: encode_packet(one, FeetechInstruction.PING, b""),
    )


def test_a_line_sags_by_the_current_of_its_own_motors_alone() -> None:
    models = [MODELS[name] for name in ("XL430-W250", "XL330-M288", "XL330-M288")]
    rails = Rails(models, 0.5, (0, 1, 1))
    stalled = rails.volts((12.0, 5.0), np.array([0.0, 1.0, 1.0]), np.zeros(3))
    # XL330-M288 at 5 V: 1.47 A at standstill, so 5 / 1.47 ohm each, behind 0.5 ohm.
    expected_v = 5.0 / (1.0 + 0.5 * 2 * 1.47 / 5.0)
    assert stalled == pytest.approx([12.0, expected_v, expected_v])
    assert rails.supply_w == pytest.approx(2 * 1.47 * expected_v)


@pytest.mark.parametrize("make", [dynamixels, feetechs])
def test_each_servo_measures_its_own_supply_and_is_dark_with_it_alone(
    make: Callable[[tuple[int, ...]], Powered],
) -> None:
    servos = make((0, 1))
    assert servos.seen(12.0, 5.0) == [(120, True), (50, True)]
    assert servos.seen(12.0, 1.0) == [(120, True), (10, False)]
    assert servos.seen(12.0, 5.0) == [(120, True), (50, True)]


def test_a_servo_on_the_wrong_supply_reports_it_and_its_neighbour_does_not() -> None:
    servos = dynamixels((0, 0))
    servos.seen(12.0)
    assert [servos.bank.register(one, "hardware_error_status") for one in IDS] == [0, 1]
