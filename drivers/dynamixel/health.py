"""Poll what changes slowly, one servo at a time, so that the cycle stays short."""

from collections import deque
from collections.abc import Callable, Sequence
from typing import Final

import numpy as np
from numpy.typing import NDArray

from drivers.dynamixel.control_table import VOLTAGE_UNIT_V
from drivers.dynamixel.link import Patience
from drivers.dynamixel.registers import Registers, decode
from drivers.dynamixel.roster import Roster
from drivers.dynamixel.servo import ServoSpec
from drivers.dynamixel.state import BusState
from drivers.errors import NoReply, ProtocolError

_STATUS_START: Final = 64  # torque_enable .. bus_watchdog
_STATUS_BYTES: Final = 35
_CLIMATE_START: Final = 144  # present_input_voltage, present_temperature
_CLIMATE_BYTES: Final = 3
_PROBE_EVERY_TURNS: Final = 5


class HealthPoll:
    """Read one servo's status or climate every few cycles; a new alert goes first and at once."""

    def __init__(
        self,
        registers: Registers,
        servos: Sequence[ServoSpec],
        roster: Roster,
        state: BusState,
        *,
        every_cycles: int,
        margin_s: float,
        on_return: Callable[[int], None],
    ) -> None:
        """Poll with the bus' own state and roster.

        `on_return` is told the index of a suspended servo that answers again.
        """
        self._registers = registers
        self._servos = servos
        self._roster = roster
        self._state = state
        self._every_cycles = every_cycles
        self._patience = Patience(margin_s=margin_s, attempts=1)
        self._on_return = on_return
        self._cycle = 0
        self._turn = 0
        self._seen_alert: NDArray[np.bool_] = np.zeros(len(servos), dtype=np.bool_)
        self._seen_alert_bytes = self._seen_alert.tobytes()
        self._urgent: deque[int] = deque()

    def step(self) -> bool:
        """Make at most one transaction after a cycle's block read; tell whether there was one.

        Raises:
            LinkLost: the adapter is gone.
        """
        self._note_alerts()
        if self._urgent:
            self._read_status(self._urgent.popleft())
            return True
        self._cycle += 1
        if self._cycle % self._every_cycles:
            return False
        self._take_turn()
        return True

    def ask_soon(self, index: int) -> None:
        """Read a servo's status in one of the next cycles."""
        if index not in self._urgent:
            self._urgent.append(index)

    def _note_alerts(self) -> None:
        alert = self._state.alert
        alert_bytes = alert.tobytes()
        if alert_bytes == self._seen_alert_bytes:  # much cheaper than comparing arrays
            return
        for index in np.flatnonzero(alert & ~self._seen_alert):
            self.ask_soon(int(index))
        self._state.error[~alert] = 0
        self._seen_alert[:] = alert
        self._seen_alert_bytes = alert_bytes

    def _take_turn(self) -> None:
        self._turn += 1
        suspended = self._roster.suspended
        if suspended and self._turn % _PROBE_EVERY_TURNS == 0:
            self._probe(suspended[self._turn // _PROBE_EVERY_TURNS % len(suspended)])
            return
        polled = self._roster.polled
        round_number, position = divmod(self._turn, len(polled))
        read = self._read_climate if round_number % 2 else self._read_status
        read(polled[position])

    def _read_status(self, index: int) -> None:
        servo = self._servos[index]
        span = self._try_span(servo, _STATUS_START, _STATUS_BYTES)
        if span is None:
            return
        state = self._state
        state.torque_on[index] = decode(servo, span, _STATUS_START, "torque_enable") != 0
        state.error[index] = decode(servo, span, _STATUS_START, "hardware_error_status")
        state.watchdog[index] = decode(servo, span, _STATUS_START, "bus_watchdog")

    def _read_climate(self, index: int) -> None:
        servo = self._servos[index]
        span = self._try_span(servo, _CLIMATE_START, _CLIMATE_BYTES)
        if span is None:
            return
        decivolt = decode(servo, span, _CLIMATE_START, "present_input_voltage")
        self._state.voltage_v[index] = decivolt * VOLTAGE_UNIT_V
        self._state.temperature_c[index] = decode(
            servo, span, _CLIMATE_START, "present_temperature"
        )

    def _try_span(self, servo: ServoSpec, start: int, size: int) -> bytes | None:
        try:
            return self._registers.read_span(servo, start, size, self._patience)
        except (NoReply, ProtocolError):  # counted by the link; the next turn asks again
            return None

    def _probe(self, index: int) -> None:
        try:
            number, _ = self._registers.ping(self._servos[index], self._patience)
        except (NoReply, ProtocolError):  # still away
            return
        if number == self._servos[index].model.number:
            self._on_return(index)
