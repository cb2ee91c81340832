"""Watch voltage, winding temperature and effort, and name the hardware errors they cause."""

from typing import Final

import numpy as np

from drivers.dynamixel.control_table import VOLTAGE_UNIT_V, HardwareError
from sim_twin.servos.columns import Columns, IntColumn
from sim_twin.servos.profile import Floats
from sim_twin.servos.spec import FirmwareOptions

CHECK_PERIOD_S: Final = 0.02


class Protection:
    """Follow each servo's temperature and overload time; checked every `CHECK_PERIOD_S`."""

    def __init__(self, columns: Columns, options: FirmwareOptions) -> None:
        count = len(columns.torque_enable)
        self._options = options
        self._temperature_limit = columns.named("temperature_limit")
        self._max_voltage = columns.named("max_voltage_limit")
        self._min_voltage = columns.named("min_voltage_limit")
        self._overload_s = np.zeros(count)
        self.temperature_c = np.full(count, options.ambient_c)

    def check(self, effort_ratio: Floats, supply_v: float, dt_s: float) -> IntColumn:
        """Return the hardware error bits that hold now, after `dt_s` of this effort."""
        options = self._options
        effort = np.abs(effort_ratio)
        target_c = options.ambient_c + options.stall_rise_c * effort * effort
        gain = min(1.0, dt_s / options.thermal_time_constant_s)
        self.temperature_c += (target_c - self.temperature_c) * gain
        overloaded = effort > options.overload_ratio
        self._overload_s = np.where(overloaded, self._overload_s + dt_s, 0.0)
        return self._bits(supply_v)

    def clear_overload(self, row: int) -> None:
        """Forget the overload time, as a reboot does; the winding stays warm."""
        self._overload_s[row] = 0.0

    def _bits(self, supply_v: float) -> IntColumn:
        supply = supply_v / VOLTAGE_UNIT_V
        voltage = (supply > self._max_voltage) | (supply < self._min_voltage)
        hot = self.temperature_c > self._temperature_limit
        overload = self._overload_s > self._options.overload_time_s
        return (
            voltage * int(HardwareError.INPUT_VOLTAGE)
            | hot * int(HardwareError.OVERHEATING)
            | overload * int(HardwareError.OVERLOAD)
        ).astype(np.int32)
