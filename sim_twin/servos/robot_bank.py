"""Choose the emulation that fits the servos of a robot's bus, and what feeds them."""

from collections.abc import Mapping
from typing import Any

from drivers.dynamixel.tables.control_table import BAUD_RATES
from drivers.feetech.table import FEETECH_BAUD_RATES, FEETECH_MODELS
from drivers.servo.family import family_of
from sim_twin.servos.bank import ServoBank
from sim_twin.servos.feetech import EmulatedFeetechSpec, FeetechBank
from sim_twin.servos.firmware.coupling import Coupling
from sim_twin.servos.protocol.timing import WireTiming
from sim_twin.servos.spec import EmulatedServoSpec
from sim_twin.servos.wire_bank import WireBank
from vla_deploy.robots.devices import ServoBus

MAIN_SUPPLY = "main"
"""What feeds all servos of a bus whose robot file declares no supplies."""


def robot_bank(bus: ServoBus, timing: WireTiming | None, coupling: Coupling) -> WireBank[Any]:
    """Return the servos as their integrator left them: ids and baud rate are set.

    Raises:
        ValueError: a model is of another family than the first one.
    """
    models = {servo.id: servo.model for servo in bus.all_servos}
    names = list(supply_volts(bus))
    fed_by = [bus.supply_of(servo.id) for servo in bus.all_servos]
    feeds = [names.index(supply.name) if supply else 0 for supply in fed_by]
    if bus.servos[0].model in FEETECH_MODELS:
        code = _code(FEETECH_BAUD_RATES, bus.baud)
        feetech = [
            EmulatedFeetechSpec(id=one, model_name=model, eeprom={"baud_rate": code})
            for one, model in models.items()
        ]
        return FeetechBank(feetech, timing=timing, coupling=coupling, feeds=feeds)
    code = _code(BAUD_RATES, bus.baud)
    dynamixel = [
        EmulatedServoSpec(id=one, model_name=model, eeprom={"baud_rate": code})
        for one, model in models.items()
    ]
    return ServoBank(dynamixel, timing=timing, coupling=coupling, feeds=feeds)


def supply_volts(bus: ServoBus) -> dict[str, float]:
    """Return the voltage of each supply; where none is declared, what the first servo is made for.

    A bank counts its supplies in this order.
    """
    if bus.supplies:
        return {supply.name: supply.voltage_v for supply in bus.supplies}
    model = bus.servos[0].model
    return {MAIN_SUPPLY: family_of(model).facts(model).nominal_v}


def _code(rates: Mapping[int, int], baud: int) -> int:
    return next(code for code, rate in rates.items() if rate == baud)
