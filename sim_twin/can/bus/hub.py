"""Serve the CAN wire to other processes over a Unix socket: the hub that `vla_hub` speaks to."""

import logging
import socket
from collections.abc import Callable
from pathlib import Path
from typing import Final

import can

from drivers.can_hub import FRAME_BYTES, decode_frame, encode_frame
from drivers.errors import DeviceBusy, ProtocolError
from sim_twin.can.bus.wire import CanWire

FRAMES_PER_POLL: Final = 256
_LOG = logging.getLogger(__name__)


class _Client:
    """Pass frames between one connection and the wire, never waiting for the other end."""

    def __init__(self, connection: socket.socket) -> None:
        connection.setblocking(False)
        self.connection = connection
        self.frames_dropped = 0
        self.port = self._deliver

    def _deliver(self, frame: can.Message) -> None:
        try:
            self.connection.send(encode_frame(frame))
        except BlockingIOError:
            self.frames_dropped += 1
        except OSError as error:
            # The read side sees the same end of the connection and detaches the client.
            _LOG.debug("CAN client is gone: %s", error)
            self.frames_dropped += 1

    def read(self) -> bytes | None:
        """Return one packet, b"" at the end of the connection, None when nothing waits."""
        try:
            return self.connection.recv(FRAME_BYTES + 1)
        except BlockingIOError:
            return None
        except ConnectionError:
            return b""


class CanHub:
    """Accept clients at a socket path and pass frames among them and the emulated nodes.

    The owner polls `filenos()` and calls `poll_once()`; nothing here waits or starts a thread.
    """

    def __init__(
        self, wire: CanWire, path: Path, on_packet: Callable[[bytes], None] = lambda _: None
    ) -> None:
        """Listen at `path`; `on_packet` gets what hosts send.

        Raises:
            DeviceBusy: another hub listens there.
        """
        self._wire = wire
        self._path = path
        self._on_packet = on_packet
        self._clients: list[_Client] = []
        self.packets_malformed = 0
        self._frames_dropped = 0
        _remove_stale(path)
        self._listener = _listening_at(path)

    @property
    def frames_dropped(self) -> int:
        """Return how many frames were lost for want of room, towards a client or from one."""
        return self._frames_dropped + sum(client.frames_dropped for client in self._clients)

    def filenos(self) -> list[int]:
        """Return the descriptors whose readability calls for `poll_once`."""
        sockets = [self._listener, *(client.connection for client in self._clients)]
        return [each.fileno() for each in sockets]

    def poll_once(self) -> None:
        """Accept who knocks and carry what has been sent."""
        self._accept()
        self.carry_once()

    def carry_once(self) -> None:
        """Carry what the clients that are known have sent."""
        for client in tuple(self._clients):
            self._serve(client)

    def _accept(self) -> None:
        try:
            connection, _ = self._listener.accept()
        except BlockingIOError:
            return
        client = _Client(connection)
        self._clients.append(client)
        self._wire.attach(client.port)

    def _serve(self, client: _Client) -> None:
        for _ in range(FRAMES_PER_POLL):
            packet = client.read()
            if packet is None:
                return
            if not packet:
                self._dismiss(client)
                return
            self._carry(packet, client)

    def _carry(self, packet: bytes, client: _Client) -> None:
        self._on_packet(packet)
        try:
            frame = decode_frame(packet)
        except ProtocolError as error:
            self.packets_malformed += 1
            _LOG.warning("dropped: %s", error)
            return
        client.frames_dropped += not self._wire.send(frame, client.port)

    def _dismiss(self, client: _Client) -> None:
        self._wire.detach(client.port)
        self._clients.remove(client)
        self._frames_dropped += client.frames_dropped
        client.connection.close()

    def close(self) -> None:
        """Dismiss all clients and remove the socket; closing twice is allowed."""
        for client in tuple(self._clients):
            self._dismiss(client)
        self._listener.close()
        self._path.unlink(missing_ok=True)


def _listening_at(path: Path) -> socket.socket:
    """Listen under a passing name first, so that who sees `path` can connect."""
    passing = path.with_name(f"{path.name}.new")
    passing.unlink(missing_ok=True)
    listener = socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    listener.setblocking(False)
    listener.bind(str(passing))
    listener.listen()
    passing.rename(path)
    return listener


def _remove_stale(path: Path) -> None:
    """Remove a dead hub's socket."""
    if not path.exists():
        return
    with socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET) as probe:
        try:
            probe.connect(str(path))
        except ConnectionRefusedError:
            path.unlink()
            return
    raise DeviceBusy(f"CAN hub {path}: another hub listens there; stop that twin first")
