"""Offer the control tables of the X series: `model` has the types, `models` the data."""

from drivers.dynamixel.tables.model import (
    BAUD_RATES,
    CENTRE_PULSE,
    CURRENT_UNIT_A,
    LOAD_UNIT_RATIO,
    PULSE_RAD,
    PULSES_PER_REV,
    PWM_FULL,
    VELOCITY_UNIT_RAD_S,
    VOLTAGE_UNIT_V,
    WATCHDOG_MAX,
    WATCHDOG_TRIPPED,
    WATCHDOG_UNIT_S,
    IndirectBank,
    OperatingMode,
    Register,
    ServoDatasheet,
    StatusReturnLevel,
)
from drivers.dynamixel.tables.models import MODELS, MODELS_BY_NUMBER

__all__ = [
    "BAUD_RATES",
    "CENTRE_PULSE",
    "CURRENT_UNIT_A",
    "LOAD_UNIT_RATIO",
    "MODELS",
    "MODELS_BY_NUMBER",
    "PULSES_PER_REV",
    "PULSE_RAD",
    "PWM_FULL",
    "VELOCITY_UNIT_RAD_S",
    "VOLTAGE_UNIT_V",
    "WATCHDOG_MAX",
    "WATCHDOG_TRIPPED",
    "WATCHDOG_UNIT_S",
    "IndirectBank",
    "OperatingMode",
    "Register",
    "ServoDatasheet",
    "StatusReturnLevel",
]
