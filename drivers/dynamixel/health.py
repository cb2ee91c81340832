"""Poll what changes slowly, one servo at a time, so that the cycle stays short."""

from collections import deque
from collections.abc import Callable, Collection, Iterator, Sequence
from typing import Final

import numpy as np
from numpy.typing import NDArray

from drivers.dynamixel.servo import ServoSpec
from drivers.dynamixel.tables.control_table import VOLTAGE_UNIT_V
from drivers.dynamixel.tables.registers import Registers, decode
from drivers.errors import DriverError, LinkLost, NoReply, ProtocolError
from drivers.servo.patience import ReplyPatience
from drivers.servo.roster import Roster
from drivers.servo.state import BusState

_STATUS_START: Final = 64  # torque_enable .. bus_watchdog
_STATUS_BYTES: Final = 35
_CLIMATE_START: Final = 144  # present_input_voltage, present_temperature
_CLIMATE_BYTES: Final = 3
_PROBE_EVERY_TURNS: Final = 5
_MARGIN_SHARE: Final = 0.9
"""A probe of a missing servo must not cost a cycle more than that servo's part of the block did."""


class HealthPoll:
    """Read one servo's status or climate every few cycles; a new alert goes first and at once.

    Servos whose block already holds both are left out. A servo that returns is set up again with
    one transaction per cycle, so that the others are not kept waiting.
    """

    def __init__(
        self,
        registers: Registers,
        servos: Sequence[ServoSpec],
        roster: Roster,
        state: BusState,
        *,
        asked: Collection[int],
        every_cycles: int,
        margin_s: float,
        bring_back: Callable[[int], Iterator[None]],
    ) -> None:
        """Poll the servos `asked` (by index) with the bus' own state and roster.

        `bring_back` sets up a suspended servo that answers again, a transaction at each step.
        """
        self._registers = registers
        self._servos = servos
        self._roster = roster
        self._state = state
        self._every_cycles = every_cycles
        self._patience = ReplyPatience(margin_s=margin_s * _MARGIN_SHARE, attempts=1)
        self._bring_back = bring_back
        self._returns: dict[int, Iterator[None]] = {}
        self._asked = np.zeros(len(servos), dtype=np.bool_)
        self._asked[list(asked)] = True
        self._cycle = 0
        self._turn = 0
        self._probes = 0
        self._seen_alert: NDArray[np.bool_] = np.zeros(len(servos), dtype=np.bool_)
        self._urgent: deque[int] = deque()

    def step(self) -> bool:
        """Make at most one transaction after a cycle's block read; tell whether there was one.

        Raises:
            LinkLost: the adapter is gone.
        """
        if self._urgent:
            self._read_status(self._urgent.popleft())
            return True
        if self._returns:
            self._go_on_with_return()
            return True
        self._cycle += 1
        if self._cycle % self._every_cycles:
            return False
        return self._take_turn()

    def expect(self, index: int) -> None:
        """Set a suspended servo up again that is known to answer; one that is at it goes on."""
        if index not in self._returns:
            self._returns[index] = self._bring_back(index)

    def ask_soon(self, index: int) -> None:
        """Read a servo's status in one of the next cycles."""
        if index not in self._urgent:
            self._urgent.append(index)

    def note_alerts(self) -> None:
        """Ask a servo that has begun to report an error for its status, first of all."""
        alert = self._state.alert
        for index in np.flatnonzero(alert & ~self._seen_alert & self._asked):
            self.ask_soon(int(index))
        self._state.error[~alert & self._asked] = 0
        self._seen_alert[:] = alert

    def _go_on_with_return(self) -> None:
        index, steps = next(iter(self._returns.items()))
        try:
            next(steps)
        except StopIteration:
            del self._returns[index]
        except LinkLost:
            raise
        except DriverError:  # counted by the link; the next probe begins anew
            del self._returns[index]

    def _take_turn(self) -> bool:
        self._turn += 1
        suspended = self._roster.suspended
        mostly_away = len(suspended) > len(self._roster.polled)
        if suspended and (mostly_away or self._turn % _PROBE_EVERY_TURNS == 0):
            self._probes += 1
            self._probe(suspended[self._probes % len(suspended)])
            return True
        polled = [index for index in self._roster.polled if self._asked[index]]
        if not polled:
            return False
        round_number, position = divmod(self._turn, len(polled))
        read = self._read_climate if round_number % 2 else self._read_status
        read(polled[position])
        return True

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
        self._state.climate_stamp_ns[index] = self._registers.link.now_ns()

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
            self.expect(index)
