"""Open the door's address, plain or TLS as the dashboard's."""

import socket
import ssl
from typing import Final

from vla_deploy.runtime.net import (
    DashboardSettings,
    PortTaken,
    TlsUnusable,
    open_port,
    server_context,
)
from vla_deploy.stop_door.errors import DoorClosed

_MAPPED: Final = "::ffff:"


class Listener:
    """Hold a listening socket that never waits."""

    def __init__(self, listening: socket.socket, tls: ssl.SSLContext | None = None) -> None:
        listening.setblocking(False)
        self.socket = listening
        self._tls = tls

    @property
    def port(self) -> int:
        """Return the port that it listens at."""
        port: int = self.socket.getsockname()[1]
        return port

    def accept(self) -> tuple[socket.socket, str]:
        """Return a client, which never waits either, and its address.

        Raises:
            BlockingIOError: there is none now.
            OSError: it was lost, or no descriptor is left.
        """
        client, address = self.socket.accept()
        client.setblocking(False)
        if self._tls is not None:
            client = _secured(client, self._tls)
        return client, str(address[0]).removeprefix(_MAPPED)

    def close(self) -> None:
        """Stop listening."""
        self.socket.close()


def open_listener(
    settings: DashboardSettings, *, search: bool = False, before: int | None = None
) -> Listener:
    """Listen where the settings say; where that is taken, `search` on as the dashboard does.

    `before` is the port of an earlier instance, at which open pages look for the door.

    Raises:
        DoorClosed: the address cannot be had, or certificate and key cannot be used.
    """
    tls = _tls(settings) if settings.tls_certificate else None
    try:
        listening = open_port(settings.host, settings.stop_port, search=search, before=before)
    except (PortTaken, OSError) as error:
        raise DoorClosed(f"stop_port: {error}") from error
    return Listener(listening, tls)


def _secured(client: socket.socket, tls: ssl.SSLContext) -> ssl.SSLSocket:
    try:
        client.getpeername()
    except OSError:  # it has gone: to wrap it would fail, too, but leave it open
        client.close()
        raise
    return tls.wrap_socket(client, server_side=True, do_handshake_on_connect=False)


def _tls(settings: DashboardSettings) -> ssl.SSLContext:
    try:
        return server_context(settings.tls_certificate, settings.tls_key)
    except TlsUnusable as error:
        raise DoorClosed(str(error)) from error
