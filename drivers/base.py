"""Declare the byte transport that every serial or stream driver talks through."""

from typing import Protocol, runtime_checkable


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


@runtime_checkable
class BurstTransport(Protocol):
    """Offer, on top of a `ByteTransport`, to wait for many bytes with few wake-ups."""

    def read_burst(self, count: int, due_ns: int, deadline_ns: int) -> bytes:
        """Return `count` bytes, or what of them has arrived by `deadline_ns`.

        At `due_ns` all of them should have arrived, so that nobody need look before.

        Raises:
            LinkLost: the other end has gone.
        """
        ...


@runtime_checkable
class TunableTransport(Protocol):
    """Offer, on top of a `ByteTransport`, to try other speeds."""

    @property
    def bauds(self) -> tuple[int, ...]:
        """Return the speeds on offer."""
        ...

    def set_baud(self, baud: int) -> None:
        """Go on at another speed; what was not read is dropped.

        Raises:
            ValueError: the speed is none of `bauds`.
            LinkLost: the other end has gone.
        """
        ...


@runtime_checkable
class CheckedTransport(Protocol):
    """Offer, on top of a `ByteTransport`, to tell what is wrong with the adapter."""

    def adapter_fault(self) -> str:
        """Return what slows the adapter down and how to mend it, or "" when nothing does."""
        ...
