"""Keep the Bus Watchdog's state: the servos stop by themselves when the bus falls silent."""

from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum
from math import ceil
from types import MappingProxyType
from typing import Final

from drivers.dynamixel.tables.control_table import WATCHDOG_MAX, WATCHDOG_UNIT_S


class WatchdogState(Enum):
    """Name the states of the watchdogs of one bus."""

    OFF = "off"
    ARMED = "armed"
    TRIPPED = "tripped"
    """At least one servo has stopped by itself and refuses goals."""
    CLEARED = "cleared"
    """Goals are taken again; torque must be enabled anew, which starts at the measured pose."""


class WatchdogEvent(Enum):
    """Name what changes the state."""

    ARM = "arm"
    TRIP = "trip"
    CLEAR = "clear"
    TORQUE_OFF = "torque off"


TRANSITIONS: Final[Mapping[tuple[WatchdogState, WatchdogEvent], WatchdogState]] = MappingProxyType(
    {
        (WatchdogState.OFF, WatchdogEvent.ARM): WatchdogState.ARMED,
        (WatchdogState.CLEARED, WatchdogEvent.ARM): WatchdogState.ARMED,
        (WatchdogState.OFF, WatchdogEvent.TRIP): WatchdogState.TRIPPED,
        (WatchdogState.ARMED, WatchdogEvent.TRIP): WatchdogState.TRIPPED,
        (WatchdogState.CLEARED, WatchdogEvent.TRIP): WatchdogState.TRIPPED,
        (WatchdogState.TRIPPED, WatchdogEvent.CLEAR): WatchdogState.CLEARED,
        (WatchdogState.ARMED, WatchdogEvent.TORQUE_OFF): WatchdogState.OFF,
        (WatchdogState.CLEARED, WatchdogEvent.TORQUE_OFF): WatchdogState.OFF,
    }
)
"""Every other pair leaves the state as it is; so a trip is left by `CLEAR` only."""


def next_state(state: WatchdogState, event: WatchdogEvent) -> WatchdogState:
    """Return the state after an event."""
    return TRANSITIONS.get((state, event), state)


@dataclass(slots=True)
class WatchdogGuard:
    """Hold the state of the watchdogs of one bus."""

    state: WatchdogState = WatchdogState.OFF

    def note(self, event: WatchdogEvent) -> None:
        """Go on to the state after an event."""
        self.state = next_state(self.state, event)


def watchdog_units(timeout_s: float) -> int:
    """Return the register value for a timeout, rounded up to 20 ms.

    Raises:
        ValueError: the timeout is not within 20 ms .. 2.54 s.
    """
    units = ceil(round(timeout_s / WATCHDOG_UNIT_S, 6))
    if not 1 <= units <= WATCHDOG_MAX:
        longest_s = WATCHDOG_MAX * WATCHDOG_UNIT_S
        raise ValueError(f"bus watchdog must be 0.02..{longest_s:.2f} s, got {timeout_s} s")
    return units
