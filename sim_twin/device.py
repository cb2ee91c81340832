"""Declare what every emulated device has in common: bytes in, bytes out, simulated time."""

from typing import Protocol


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
