"""Watch voltage, temperature and effort, and name the hardware errors they cause."""

from collections.abc import Sequence
from typing import Final

import numpy as np
from numpy.typing import NDArray

from drivers.dynamixel.model import VOLTAGE_UNIT_V, HardwareError, Model
from sim_twin.servos.columns import Columns, IntColumn
from sim_twin.servos.profile import Floats
from sim_twin.servos.spec import FirmwareOptions
from sim_twin.servos.thermal import Thermals

CHECK_PERIOD_S: Final = 0.02


class Protection:
    """Follow each servo's temperature and overload time; checked every `CHECK_PERIOD_S`."""

    def __init__(self, models: Sequence[Model], columns: Columns, options: FirmwareOptions) -> None:
        count = len(models)
        self._options = options
        self._temperature_limit = columns.named("temperature_limit")
        self._max_voltage = columns.named("max_voltage_limit")
        self._min_voltage = columns.named("min_voltage_limit")
        self._overload_s = np.zeros(count)
        self._none = np.zeros(count, np.int32)
        self._forced_overload = np.zeros(count, np.bool_)
        self.thermals = Thermals(models, options.ambient_c)
        self.reload()

    def check(self, effort_ratio: Floats, supply_v: float, dt_s: float) -> IntColumn:
        """Return the hardware error bits that hold now, after `dt_s` of this effort."""
        options = self._options
        self.thermals.advance(effort_ratio, dt_s)
        overloaded = np.abs(effort_ratio) > options.overload_ratio
        self._overload_s += dt_s
        self._overload_s *= overloaded
        return self._none if self._is_fine(overloaded, supply_v) else self._bits(supply_v)

    def reload(self) -> None:
        """Take over limits that the host changed."""
        self._highest_supply = int(self._max_voltage.min())
        self._lowest_supply = int(self._min_voltage.max())
        self._coolest_limit_c = int(self._temperature_limit.min())

    def clear_overload(self, row: int) -> None:
        """Forget the overload time, as a reboot does; the winding stays warm."""
        self._overload_s[row] = 0.0

    def force_overload(self, row: int, *, on: bool) -> None:
        """Count a servo as overloaded whatever its effort, or no longer."""
        self._forced_overload[row] = on

    def _is_fine(self, overloaded: NDArray[np.bool_], supply_v: float) -> bool:
        """Tell whether no servo can have an error, which is nearly always so."""
        supply = supply_v / VOLTAGE_UNIT_V
        return bool(
            self._lowest_supply <= supply <= self._highest_supply
            and self.thermals.body_c.max() <= self._coolest_limit_c
            and not overloaded.any()
            and not self._forced_overload.any()
        )

    def _bits(self, supply_v: float) -> IntColumn:
        supply = supply_v / VOLTAGE_UNIT_V
        voltage = (supply > self._max_voltage) | (supply < self._min_voltage)
        hot = self.thermals.body_c > self._temperature_limit
        overload = (self._overload_s > self._options.overload_time_s) | self._forced_overload
        return (
            voltage * int(HardwareError.INPUT_VOLTAGE)
            | hot * int(HardwareError.OVERHEATING)
            | overload * int(HardwareError.OVERLOAD)
        ).astype(np.int32)
