"""Count errors as a CAN controller does and derive its state (ISO 11898-1, fault confinement)."""

from enum import IntEnum
from typing import Final

TRANSMIT_ERROR: Final = 8
RECEIVE_ERROR: Final = 1
FIRST_TO_FLAG: Final = 8
WARNING_LIMIT: Final = 96
PASSIVE_LIMIT: Final = 128
BUS_OFF_LIMIT: Final = 256
RECEIVE_AFTER_PASSIVE: Final = 119


class ErrorState(IntEnum):
    """Name the states of a controller, the better the lower; a warning has no effect of its own."""

    ACTIVE = 0
    WARNING = 1
    PASSIVE = 2
    BUS_OFF = 3


class ErrorCounters:
    """Hold the transmit and the receive error counter, TEC and REC, of one controller."""

    __slots__ = ("rec", "tec")

    def __init__(self) -> None:
        self.tec = 0
        self.rec = 0

    @property
    def state(self) -> ErrorState:
        """Return what the counters amount to."""
        if self.tec >= BUS_OFF_LIMIT:
            return ErrorState.BUS_OFF
        worst = max(self.tec, self.rec)
        if worst >= PASSIVE_LIMIT:
            return ErrorState.PASSIVE
        return ErrorState.WARNING if worst >= WARNING_LIMIT else ErrorState.ACTIVE

    def transmitted(self) -> None:
        """Count a frame that went well."""
        if self.tec:
            self.tec -= 1

    def received(self) -> None:
        """Count a frame that came well."""
        if self.rec >= PASSIVE_LIMIT:
            self.rec = RECEIVE_AFTER_PASSIVE
        elif self.rec:
            self.rec -= 1

    def transmit_failed(self) -> None:
        """Count an error while transmitting."""
        self.tec = min(self.tec + TRANSMIT_ERROR, BUS_OFF_LIMIT)

    def not_acknowledged(self) -> None:
        """Count a missing acknowledgement, which alone never makes a passive controller bus-off."""
        if self.tec < PASSIVE_LIMIT:
            self.transmit_failed()

    def receive_failed(self, first: bool) -> None:
        """Count an error while receiving; who flags it `first` hears the others' flags after."""
        if self.rec < PASSIVE_LIMIT:
            self.rec += RECEIVE_ERROR + FIRST_TO_FLAG * first

    def go_bus_off(self) -> None:
        """Leave the bus."""
        self.tec = BUS_OFF_LIMIT

    def reset(self) -> None:
        """Begin anew, as after the recovery from bus-off."""
        self.tec = self.rec = 0
