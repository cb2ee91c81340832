"""Watch voltage, temperature, current and load, and hold the errors they cause.

Source: FEETECH, "SMS/STS memory table" (13 to 20, 28, 34 to 38). Voltage and temperature are
reported while they are out of their limits. Overload and over-current are held until power is lost.
"""

from typing import Final

import numpy as np
from numpy.typing import NDArray

from drivers.feetech.table import (
    ERROR_BITS,
    FEETECH_CURRENT_UNIT_A,
    FEETECH_VOLTAGE_UNIT_V,
    PROTECTION_TIME_UNIT_S,
)
from drivers.servo.hardware_error import HardwareError
from sim_twin.servos.feetech.memory import FeetechMemory
from sim_twin.servos.firmware.profile import Floats
from sim_twin.servos.firmware.thermal import ThermalBody, Thermals

BITS: Final = {error: bit for bit, error in ERROR_BITS.items()}
_VOLTAGE: Final = BITS[HardwareError.INPUT_VOLTAGE]
_HEAT: Final = BITS[HardwareError.OVERHEATING]
_CURRENT: Final = BITS[HardwareError.OVERCURRENT]
_LOAD: Final = BITS[HardwareError.OVERLOAD]
_PER_CENT: Final = 0.01


def error_bits(errors: int) -> int:
    """Return bits of `HardwareError` as FEETECH's error byte has them.

    Raises:
        ValueError: these servos have no such error.
    """
    unknown = [error.name for error in HardwareError(errors) if error not in BITS]
    if unknown:
        raise ValueError(f"FEETECH servos report no {', '.join(map(str, unknown))}")
    return sum(BITS[error] for error in HardwareError(errors))


class FeetechProtection:
    """Follow each servo's temperature and the times of overload; `errors` holds the error bytes."""

    def __init__(self, memory: FeetechMemory, ambient_c: float) -> None:
        count = len(memory)
        self._memory = memory
        bodies = [ThermalBody(sheet.mass_g, sheet.size_mm) for sheet in memory.sheets]
        self.thermals = Thermals(memory.sheets, ambient_c, bodies)
        self._stall_a = np.array([sheet.stall_current_a for sheet in memory.sheets])
        self._overload_s = np.zeros(count)
        self._overcurrent_s = np.zeros(count)
        self._forced = np.zeros(count, np.bool_)
        self._latched = np.zeros(count, np.int64)
        self.errors = np.zeros(count, np.int64)
        self.reload()

    def reload(self) -> None:
        """Take over limits that the host changed."""
        column = self._memory.column
        self._hottest_c = column("temperature_limit")
        self._highest_v = column("max_voltage_limit") * FEETECH_VOLTAGE_UNIT_V
        self._lowest_v = column("min_voltage_limit") * FEETECH_VOLTAGE_UNIT_V
        self._most_load = column("overload_torque") * _PER_CENT
        self._overload_after_s = column("protection_time") * PROTECTION_TIME_UNIT_S
        most_a = column("protection_current") * FEETECH_CURRENT_UNIT_A
        self._most_a = np.where(most_a > 0.0, most_a, np.inf)
        self._overcurrent_after_s = column("overcurrent_time") * PROTECTION_TIME_UNIT_S
        self._shutdown = column("shutdown")
        self._protective = column("protective_torque") * _PER_CENT

    def check(self, effort_ratio: Floats, pwm: Floats, volts: Floats, dt_s: float) -> None:
        """Bring the errors up to date after `dt_s` of this current and this load."""
        self.thermals.advance(effort_ratio, dt_s)
        self._overload_s = (self._overload_s + dt_s) * (np.abs(pwm) > self._most_load)
        current = self.current_a(effort_ratio)
        self._overcurrent_s = (self._overcurrent_s + dt_s) * (current > self._most_a)
        loaded = (self._overload_s > 0.0) & (self._overload_s >= self._overload_after_s)
        fed = (self._overcurrent_s > 0.0) & (self._overcurrent_s >= self._overcurrent_after_s)
        self._latched |= (loaded | self._forced) * _LOAD | fed * _CURRENT
        # A hundredth of a unit: a register's 4.0 V are not above a rail's 4.0 V.
        slack_v = FEETECH_VOLTAGE_UNIT_V * _PER_CENT
        voltage = (volts > self._highest_v + slack_v) | (volts < self._lowest_v - slack_v)
        heat = np.rint(self.thermals.body_c) >= self._hottest_c
        self.errors = self._latched | voltage * _VOLTAGE | heat * _HEAT

    def current_a(self, effort_ratio: Floats) -> Floats:
        """Return the magnitude of the motors' current."""
        current: Floats = np.abs(effort_ratio) * self._stall_a
        return current

    @property
    def cap(self) -> Floats:
        """Return the largest duty: less where an overload is held that counts."""
        return np.where(self.errors & self._shutdown & _LOAD, self._protective, 1.0)

    @property
    def tripped(self) -> NDArray[np.bool_]:
        """Return which servos have an error that takes their torque away."""
        tripped: NDArray[np.bool_] = (self.errors & self._shutdown & ~_LOAD) != 0
        return tripped

    def hold(self, row: int, bits: int) -> None:
        """Hold these error bits until power is lost."""
        self._latched[row] |= bits
        self.errors[row] |= bits

    def clear(self, row: int) -> None:
        """Forget what is held, as loss of power does; the motor stays warm."""
        self._latched[row] = self.errors[row] = 0
        self._overload_s[row] = self._overcurrent_s[row] = 0.0

    def force_overload(self, row: int, *, on: bool) -> None:
        """Count a servo as overloaded whatever its load, or no longer; what is held stays held."""
        self._forced[row] = on
