"""Declare the byte transport that every serial or stream driver talks through."""

from typing import Protocol


class ByteTransport(Protocol):
    """Carry bytes to and from one device: a tty, a socket, or the twin's in-memory line."""

    def write(self, data: bytes) -> None:
        """Hand all of `data` to the line.

        Raises:
            LinkLost: the other end has gone.
        """
        ...

    def read(self, max_bytes: int, deadline_ns: int) -> bytes:
        """Return 1..max_bytes as soon as any have arrived, or b"" at `deadline_ns`.

        A deadline in the past polls. The clock is the one the transport was built with.

        Raises:
            LinkLost: the other end has gone.
        """
        ...

    def discard_input(self) -> None:
        """Drop what has arrived and was not read."""
        ...

    def close(self) -> None:
        """Release the device; closing twice is allowed."""
        ...
