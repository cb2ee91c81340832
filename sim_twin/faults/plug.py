"""Pull and push the cable of one device, whoever carries its bytes."""

from typing import Protocol


class Carrier(Protocol):
    """Carry a device's bytes as long as it is plugged in."""

    def unplug(self) -> None:
        """Lose the link."""
        ...

    def replug(self) -> None:
        """Have a link again."""
        ...


class Plug:
    """Remember whether the cable is in, and tell those who carry its bytes.

    A `socket` comes back with the cable, as a terminal behind its path does. A `connection` does
    not: a host that had the device open must open it again.
    """

    def __init__(self) -> None:
        self.is_in = True
        self._sockets: list[Carrier] = []
        self._connections: list[Carrier] = []

    def add_socket(self, socket: Carrier) -> None:
        """Pull and push this one too."""
        self._sockets.append(socket)

    def add_connection(self, connection: Carrier) -> None:
        """Lose this one with the next pull."""
        self._connections.append(connection)

    def pull(self) -> None:
        """Take the cable out."""
        self.is_in = False
        for carrier in (*self._sockets, *self._connections):
            carrier.unplug()
        self._connections.clear()

    def push(self) -> None:
        """Put the cable in again."""
        self.is_in = True
        for socket in self._sockets:
            socket.replug()
