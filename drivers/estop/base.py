"""Declare what every emergency-stop input gives: released, or a reason why not.

This is an input to the stack's software stop. It does not replace the button's own contact in the
supply of the drives.
"""

from dataclasses import dataclass
from enum import Enum
from typing import Protocol


class ButtonState(Enum):
    """Name what is known of the button; all but RELEASED stop the robot."""

    RELEASED = "released"
    PRESSED = "pressed"
    UNKNOWN = "unknown"
    LOST = "lost"


@dataclass(frozen=True, slots=True, kw_only=True)
class EstopReading:
    """Say what the button says at `stamp_ns`; `reason` is empty when it is released."""

    state: ButtonState
    stamp_ns: int
    reason: str = ""

    @property
    def pressed(self) -> bool:
        """Return whether the robot must stop: whatever is not surely released counts."""
        return self.state is not ButtonState.RELEASED


@dataclass(slots=True)
class EstopCounters:
    """Count what the input told."""

    presses: int = 0
    releases: int = 0
    losses: int = 0


class EstopInput(Protocol):
    """Be one open connection to a button; once LOST, close it and open another."""

    counters: EstopCounters

    def poll(self) -> EstopReading:
        """Return what the button says now; never waits, never raises: a loss is a reading."""
        ...

    def close(self) -> None:
        """Release the device; closing twice is allowed."""
        ...
