"""Declare a relay in the servos' supply that is closed only while this computer feeds it."""

from typing import Protocol

from drivers.base import ByteTransport


class PowerRelay(Protocol):
    """Be one open connection; when it is lost, make another. Every method may raise LinkLost."""

    def feed(self) -> None:
        """Keep the supply on; call it twenty times a second."""
        ...

    def cut(self) -> None:
        """Let the supply go off, by a command or by no more pulses; calling it again is allowed."""
        ...

    def close(self) -> None:
        """Stop feeding and release the device; closing twice is allowed."""
        ...


class LevelOutput(Protocol):
    """Drive one line high or low."""

    def drive(self, active: bool) -> None:
        """Drive the line.

        Raises:
            LinkLost: it has gone.
        """
        ...

    def close(self) -> None:
        """Release the line; closing twice is allowed."""
        ...


class RelayOpener(Protocol):
    """Open what a relay hangs on, by the device's name."""

    def serial(self, name: str) -> ByteTransport:
        """Open a serial line.

        Raises:
            DeviceMissing: the device is not there.
            DeviceBusy: another process holds it.
        """
        ...

    def gpio_output(self, name: str, offset: int) -> LevelOutput:
        """Open a GPIO line as an output.

        Raises:
            DeviceMissing: there is no such chip or line.
            DeviceBusy: another process holds the line.
        """
        ...
