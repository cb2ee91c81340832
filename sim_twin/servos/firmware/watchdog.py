"""Time the bus watchdog (98) of every servo: 20 ms units, running only while torque is on.

Source: ROBOTIS e-manual XM430-W350, "Bus Watchdog". The manual leaves open what happens to a value
1..127 written while tripped; here only 0 clears it.
"""

from collections.abc import Iterable
from typing import Final

from drivers.clock import NS_PER_S
from drivers.dynamixel.tables.control_table import WATCHDOG_UNIT_S
from sim_twin.servos.firmware.columns import TableColumns

_UNIT_NS: Final = round(WATCHDOG_UNIT_S * NS_PER_S)
_NEVER: Final = 1 << 62


class BusWatchdog:
    """Hold one deadline per servo; a packet pushes it out. None has passed before `earliest_ns`."""

    def __init__(self, columns: TableColumns) -> None:
        count = len(columns.bus_watchdog)
        self._columns = columns
        self._deadlines_ns = [_NEVER] * count
        self._timeouts_ns = [0] * count
        # Feeding only moves deadlines out, so the last known earliest one is a safe lower bound.
        self.earliest_ns = _NEVER

    def reload(self, row: int, now_ns: int) -> None:
        """Start, restart or stop the timer after a change of bus_watchdog or torque_enable."""
        value = int(self._columns.bus_watchdog[row])
        runs = value > 0 and bool(self._columns.torque_enable[row])
        self._timeouts_ns[row] = value * _UNIT_NS if runs else 0
        self._deadlines_ns[row] = now_ns + value * _UNIT_NS if runs else _NEVER
        self.earliest_ns = min(self._deadlines_ns)

    def feed(self, rows: Iterable[int], now_ns: int) -> None:
        """Count a packet to these servos as communication."""
        for row in rows:
            timeout_ns = self._timeouts_ns[row]
            if timeout_ns:
                self._deadlines_ns[row] = now_ns + timeout_ns

    def expired(self, now_ns: int) -> list[int]:
        """Return the servos whose time has run out, and stop their timers."""
        if now_ns < self.earliest_ns:
            return []
        rows = [row for row, deadline in enumerate(self._deadlines_ns) if deadline <= now_ns]
        for row in rows:
            self._deadlines_ns[row] = _NEVER
            self._timeouts_ns[row] = 0
        self.earliest_ns = min(self._deadlines_ns)
        return rows
