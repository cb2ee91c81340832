"""Watch voltage, temperature and effort, and name the hardware errors they cause."""

from collections.abc import Sequence
from typing import Final

import numpy as np
from numpy.typing import NDArray

from drivers.dynamixel.tables.model import VOLTAGE_UNIT_V, ServoDatasheet
from drivers.servo.hardware_error import HardwareError
from sim_twin.servos.firmware.columns import TableColumns
from sim_twin.servos.firmware.profile import Floats
from sim_twin.servos.firmware.thermal import Thermals
from sim_twin.servos.spec import FirmwareOptions

CHECK_PERIOD_S: Final = 0.02
_peak: Final = np.maximum.reduce


class ServoProtection:
    """Follow each servo's temperature and overload time; checked every `CHECK_PERIOD_S`."""

    def __init__(
        self, models: Sequence[ServoDatasheet], columns: TableColumns, options: FirmwareOptions
    ) -> None:
        count = len(models)
        self._options = options
        self._temperature_limit = columns.named("temperature_limit")
        self._max_voltage = columns.named("max_voltage_limit")
        self._min_voltage = columns.named("min_voltage_limit")
        self._overload_s = np.zeros(count)
        self._overload_runs = False
        self._overload_is_forced = False
        self._forced_overload = np.zeros(count, np.bool_)
        self.thermals = Thermals(models, options.ambient_c)
        self.reload()

    def check(
        self, effort_ratio: Floats, supply_v: Floats, dt_s: float
    ) -> Sequence[tuple[int, int]]:
        """Return rows and hardware error bits that hold now, after `dt_s` of this effort."""
        self.thermals.advance(effort_ratio, dt_s)
        effort = np.abs(effort_ratio)
        if self._overload_runs or float(_peak(effort)) > self._options.overload_ratio:
            self._count_overload(effort > self._options.overload_ratio, dt_s)
        supply = supply_v / VOLTAGE_UNIT_V
        voltage = (supply > self._max_voltage) | (supply < self._min_voltage)
        return () if self._is_fine(voltage) else self._errors(voltage)

    def _count_overload(self, overloaded: NDArray[np.bool_], dt_s: float) -> None:
        self._overload_s += dt_s
        self._overload_s *= overloaded
        self._overload_runs = bool(overloaded.any())

    def reload(self) -> None:
        """Take over limits that the host changed."""
        self._coolest_limit_c = int(self._temperature_limit.min())

    def clear_overload(self, row: int) -> None:
        """Forget the overload time, as a reboot does; the winding stays warm."""
        self._overload_s[row] = 0.0

    def force_overload(self, row: int, *, on: bool) -> None:
        """Count a servo as overloaded whatever its effort, or no longer."""
        self._forced_overload[row] = on
        self._overload_is_forced = bool(self._forced_overload.any())

    def _is_fine(self, voltage: NDArray[np.bool_]) -> bool:
        """Return whether no servo can have an error, which is nearly always so."""
        return (
            not self._overload_runs
            and not self._overload_is_forced
            and not voltage.any()
            and float(_peak(self.thermals.body_c)) <= self._coolest_limit_c
        )

    def _errors(self, voltage: NDArray[np.bool_]) -> list[tuple[int, int]]:
        hot = self.thermals.body_c > self._temperature_limit
        overload = (self._overload_s > self._options.overload_time_s) | self._forced_overload
        bits = (
            voltage * int(HardwareError.INPUT_VOLTAGE)
            | hot * int(HardwareError.OVERHEATING)
            | overload * int(HardwareError.OVERLOAD)
        )
        return [(row, found) for row, found in enumerate(bits.tolist()) if found]
