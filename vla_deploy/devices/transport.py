"""Declare what every way to a device of the home gives: it is switched, and its state read."""

from dataclasses import dataclass
from typing import Protocol


@dataclass(frozen=True, slots=True, kw_only=True)
class DeviceReading:
    """Say what a device has told of itself; `note` is how that is known, where it is unusual."""

    is_on: bool
    note: str = ""


class SwitchTransport(Protocol):
    """Be the one way to one device.

    Calls block, for a few seconds of the wall clock at most, and come one at a time, from one
    thread; `interrupt` may come from another one.
    """

    @property
    def where(self) -> str:
        """Return what is reached, for messages; it holds no password."""
        ...

    @property
    def called(self) -> str:
        """Return what the device calls itself, fit to be shown; "" where it does not."""
        return ""

    @property
    def look_period_s(self) -> float:
        """Return how often the state is worth a look."""
        ...

    def switch(self, on: bool) -> DeviceReading:
        """Switch the device and return the state that it tells then, which may be the wrong one.

        Raises:
            DeviceError: it tells no state.
        """
        ...

    def read(self) -> DeviceReading:
        """Return the state that the device tells.

        Raises:
            DeviceError: it tells none.
        """
        ...

    def interrupt(self) -> None:
        """End waiting at once, now and from now on."""
        ...

    def close(self) -> None:
        """Let go of the device; closing twice is allowed."""
        ...
