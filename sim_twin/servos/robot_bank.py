"""Choose the emulation that fits the servos of a robot's bus."""

from collections.abc import Mapping
from typing import Any

from drivers.dynamixel.tables.control_table import BAUD_RATES, MODELS
from drivers.feetech.table import FEETECH_BAUD_RATES, FEETECH_MODELS
from sim_twin.servos.bank import ServoBank
from sim_twin.servos.feetech import EmulatedFeetechSpec, FeetechBank
from sim_twin.servos.firmware.coupling import Coupling
from sim_twin.servos.protocol.timing import WireTiming
from sim_twin.servos.spec import EmulatedServoSpec
from sim_twin.servos.wire_bank import WireBank


def robot_bank(
    models: Mapping[int, str], baud: int, timing: WireTiming | None, coupling: Coupling
) -> WireBank[Any]:
    """Return the servos (model by id) as their integrator left them: ids and baud rate are set.

    Raises:
        ValueError: a model is of another family than the first one.
    """
    if next(iter(models.values())) in FEETECH_MODELS:
        code = _code(FEETECH_BAUD_RATES, baud)
        feetech = [
            EmulatedFeetechSpec(id=one, model_name=model, eeprom={"baud_rate": code})
            for one, model in models.items()
        ]
        return FeetechBank(feetech, timing=timing, coupling=coupling)
    code = _code(BAUD_RATES, baud)
    dynamixel = [
        EmulatedServoSpec(id=one, model_name=model, eeprom={"baud_rate": code})
        for one, model in models.items()
    ]
    return ServoBank(dynamixel, timing=timing, coupling=coupling)


def nominal_v(models: Mapping[int, str]) -> float:
    """Return the voltage that the first servo of a bus is made for, which supplies all of them."""
    model = next(iter(models.values()))
    return (FEETECH_MODELS[model] if model in FEETECH_MODELS else MODELS[model]).voltage_v


def _code(rates: Mapping[int, int], baud: int) -> int:
    return next(code for code, rate in rates.items() if rate == baud)
