"""Declare what every emulated device has in common: bytes in, bytes out, simulated time."""

from typing import Protocol, runtime_checkable


class WireDevice(Protocol):
    """Emulate one device at its byte interface.

    The engine calls `step` once per physics step; the line calls `receive` and `transmit` whenever
    the host writes or polls. None of them waits.
    """

    def receive(self, data: bytes) -> None:
        """Take bytes that the host has put on the line."""
        ...

    def transmit(self) -> bytes:
        """Return and forget the bytes that are ready for the host."""
        ...

    def step(self, now_ns: int) -> None:
        """Advance the firmware to simulated time `now_ns`."""
        ...


@runtime_checkable
class TimedDevice(WireDevice, Protocol):
    """Have bytes under way, which arrive at the host some time after they were asked for.

    The line calls `step` with the present time before it hands over or fetches bytes.
    """

    @property
    def paced(self) -> bool:
        """Return whether bytes take time, so that a host which waits for them lets time pass."""
        ...

    def next_due_ns(self) -> int | None:
        """Return when the next bytes arrive at the host; None when nothing is under way."""
        ...
