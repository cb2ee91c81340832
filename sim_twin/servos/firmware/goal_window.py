"""Tell which goal positions a servo just stores; any other write takes the way of single registers.

A host writes the goals of all servos in every cycle, and almost always nothing follows from them.
"""

from collections.abc import Sequence
from typing import Final

import numpy as np
from numpy.typing import NDArray

from drivers.dynamixel.tables.control_table import OperatingMode
from sim_twin.servos.firmware.columns import TableColumns
from sim_twin.servos.firmware.profile import TIME_BASED

_GOAL_MAXIMUM: Final = 1_048_575


class GoalWindow:
    """Hold the range of goals that each servo takes without further ado; none while it is off."""

    def __init__(self, columns: TableColumns) -> None:
        self._columns = columns
        self._lowest = columns.named("min_position_limit")
        self._highest = columns.named("max_position_limit")
        self.reload()

    def reload(self) -> None:
        """Take over registers that the host or the firmware changed."""
        columns = self._columns
        bounded = columns.operating_mode == OperatingMode.POSITION
        low = np.where(bounded, self._lowest.astype(np.int64), -_GOAL_MAXIMUM)
        high = np.where(bounded, self._highest.astype(np.int64), _GOAL_MAXIMUM)
        ready = (columns.torque_enable != 0) & (columns.bus_watchdog >= 0)
        ready &= (columns.drive_mode & TIME_BASED) == 0
        self._low = low
        self._high = np.where(ready, high, low - 1)

    def admits(self, rows: Sequence[int], goals: NDArray[np.int32]) -> bool:
        """Return whether all these servos just store these goals."""
        return bool(((goals >= self._low[rows]) & (goals <= self._high[rows])).all())
