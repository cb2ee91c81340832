"""Carry the levels of an output line over a byte stream, where no kernel has the line."""

from drivers.base import ByteTransport


class StreamedLevel:
    """Send each level as the digit 1 or 0."""

    def __init__(self, transport: ByteTransport) -> None:
        self._transport = transport

    def drive(self, active: bool) -> None:
        """Drive the line.

        Raises:
            LinkLost: the other end has gone.
        """
        self._transport.write(b"1" if active else b"0")

    def close(self) -> None:
        """Release the stream; closing twice is allowed."""
        self._transport.close()
