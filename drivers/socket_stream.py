"""Talk to a device that serves a Unix stream socket, such as the RGB-D camera."""

import select
import socket
from pathlib import Path

from drivers.clock import Clock, waiter_of
from drivers.errors import DeviceMissing, LinkLost

_WRITE_PATIENCE_S = 0.05
_DISCARD_BYTES = 65_536


class SocketStream:
    """Carry bytes over an AF_UNIX stream."""

    def __init__(self, path: Path, clock: Clock) -> None:
        """Connect to the socket.

        Raises:
            DeviceMissing: nothing serves it.
        """
        self._path = path
        self._clock = clock
        self._socket = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        try:
            self._socket.connect(str(path))
        except OSError as error:
            self._socket.close()
            raise DeviceMissing(
                f"{path}: {error.strerror or error}; start what serves it, or correct the path"
            ) from error
        self._socket.settimeout(_WRITE_PATIENCE_S)
        self._poll = select.poll()
        self._poll.register(self._socket, select.POLLIN)
        self._wait_readable = waiter_of(clock)

    def write(self, data: bytes) -> None:
        """Hand all of `data` to the stream.

        Raises:
            LinkLost: the other end has gone, or took no byte for 50 ms.
        """
        try:
            self._socket.sendall(data)
        except OSError as error:
            raise self._lost(str(error.strerror or error)) from error

    def read(self, max_bytes: int, deadline_ns: int) -> bytes:
        """Return 1..max_bytes as soon as any have arrived, or b"" at `deadline_ns`.

        Raises:
            LinkLost: the other end has gone.
        """
        if not self._wait_readable(self._poll, deadline_ns):
            return b""
        try:
            data = self._socket.recv(max_bytes)
        except OSError as error:
            raise self._lost(str(error.strerror or error)) from error
        if not data:
            raise self._lost("the other end closed it")
        return data

    def discard_input(self) -> None:
        """Drop what has arrived and was not read.

        Raises:
            LinkLost: the other end has gone.
        """
        while self.read(_DISCARD_BYTES, self._clock.now_ns()):
            pass

    def close(self) -> None:
        """Close the socket; closing twice is allowed."""
        self._socket.close()

    def _lost(self, reason: str) -> LinkLost:
        return LinkLost(f"{self._path}: {reason}; restart what serves it, then reconnect")
