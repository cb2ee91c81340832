"""Serve one emulated device on a Unix stream socket, as a camera's own server would."""

import socket
from collections.abc import Callable
from pathlib import Path

from sim_twin.device import WireDevice

_READ_BYTES = 65_536


class StreamLine:
    """Join a device with one client at a time; the newest connection wins.

    `hang_up` tells the device that its client has gone.
    """

    def __init__(self, device: WireDevice, path: Path, hang_up: Callable[[], None]) -> None:
        self._device = device
        self._path = path
        self._hang_up = hang_up
        self._client: socket.socket | None = None
        self._pending = memoryview(b"")
        self._listener: socket.socket | None = None
        self.replug()

    @property
    def is_backed_up(self) -> bool:
        """Return whether the client has yet to take what it was sent."""
        return len(self._pending) > 0

    def filenos(self) -> list[int]:
        """Return the descriptors whose input matters."""
        sockets = [each for each in (self._listener, self._client) if each is not None]
        return [each.fileno() for each in sockets]

    def output_filenos(self) -> list[int]:
        """Return the descriptor that has bytes waiting for room."""
        if self._client is None or not self.is_backed_up:
            return []
        return [self._client.fileno()]

    def poll_once(self) -> None:
        """Move bytes both ways as far as they go; never waits."""
        self._accept()
        if self._client is None:
            return
        try:
            self._take_input(self._client)
            self._give_output(self._client)
        except OSError:  # the client died: the device hears of it and awaits the next one
            self._drop()

    def send_once(self) -> None:
        """Give the client that is there what the device has ready; never waits."""
        if self._client is None:
            return
        try:
            self._give_output(self._client)
        except OSError:
            self._drop()

    def unplug(self) -> None:
        """Hang up and take the socket away, as pulling the cable does."""
        self._drop()
        if self._listener is not None:
            self._listener.close()
            self._listener = None
        self._path.unlink(missing_ok=True)

    def replug(self) -> None:
        """Serve the socket again; nothing happens while it is served."""
        if self._listener is not None:
            return
        self._path.unlink(missing_ok=True)
        self._listener = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        self._listener.setblocking(False)
        self._listener.bind(str(self._path))
        self._listener.listen()

    def close(self) -> None:
        """Unplug for good; closing twice is allowed."""
        self.unplug()

    def _accept(self) -> None:
        if self._listener is None:
            return
        try:
            client, _ = self._listener.accept()
        except BlockingIOError:
            return
        self._drop()
        client.setblocking(False)
        self._client = client

    def _take_input(self, client: socket.socket) -> None:
        try:
            data = client.recv(_READ_BYTES)
        except BlockingIOError:
            return
        if not data:
            raise ConnectionResetError("the client closed the stream")
        self._device.receive(data)

    def _give_output(self, client: socket.socket) -> None:
        while True:
            if not self._pending:
                self._pending = memoryview(self._device.transmit())
            if not self._pending:
                return
            try:
                self._pending = self._pending[client.send(self._pending) :]
            except BlockingIOError:
                return

    def _drop(self) -> None:
        if self._client is None:
            return
        self._client.close()
        self._client = None
        self._device.transmit()
        self._hang_up()
        self._pending = memoryview(b"")
