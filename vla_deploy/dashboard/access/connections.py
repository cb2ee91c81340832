"""Limit the number of connections, and the time that a request's head may take.

uvicorn waits without limit for a request's first bytes, which is all that a slow-loris needs.
"""

import asyncio
import socket
from collections import Counter
from typing import Any, Final

import h11
from uvicorn.protocols.http.h11_impl import H11Protocol
from uvicorn.protocols.websockets.websockets_sansio_impl import WebSocketsSansIOProtocol

from vla_deploy.dashboard.access.identity import Peer, peer_of
from vla_deploy.runtime.peer_credentials import is_own_user

MOST: Final = 256
"""Of all addresses together; connections of this computer do not count."""
MOST_PER_ADDRESS: Final = 32
HEAD_WITHIN_S: Final = 10.0
HEAD_BYTES: Final = 32 * 1024


class Connections:
    """Count open connections by the address of the peer."""

    def __init__(
        self,
        most: int = MOST,
        most_per_address: int = MOST_PER_ADDRESS,
        head_within_s: float = HEAD_WITHIN_S,
    ) -> None:
        """Start without any; `head_within_s` is the time limit for a request's head."""
        self.head_within_s = head_within_s
        self._most = most
        self._most_per_address = most_per_address
        self._by_address: Counter[str] = Counter()

    @property
    def held(self) -> int:
        """Return how many there are, without those of this computer."""
        return self._by_address.total()

    def enter(self, peer: Peer) -> bool:
        """Count one more, or return False where there are too many."""
        if not (peer.is_loopback or peer.is_socket):
            is_full = self.held >= self._most
            if is_full or self._by_address[peer.rate_key] >= self._most_per_address:
                return False
            self._by_address[peer.rate_key] += 1
        return True

    def leave(self, peer: Peer) -> None:
        """Count one less."""
        self._by_address[peer.rate_key] -= 1
        if self._by_address[peer.rate_key] <= 0:
            del self._by_address[peer.rate_key]


class ConnectionSlot:
    """Count one connection, across its upgrade from HTTP to WebSocket."""

    def __init__(self, connections: Connections, protocol: Any) -> None:
        self._connections = connections
        self._peer = peer_of({"server": protocol.server, "client": protocol.client})
        self.is_held = connections.enter(self._peer)

    def release(self) -> None:
        """Count the connection no more; calling it twice is allowed."""
        if self.is_held:
            self.is_held = False
            self._connections.leave(self._peer)


class BoundedHttp(H11Protocol):
    """Serve HTTP/1.1; abort connections whose request head is not complete in time."""

    bounds: Connections

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
        """Take a slot, or abort at once."""
        super().connection_made(transport)
        self._slot = ConnectionSlot(self.bounds, self)
        self._head_timer: asyncio.TimerHandle | None = None
        if self._slot.is_held and _is_welcome(transport):
            self._await_head()
        else:
            transport.abort()

    def connection_lost(self, exc: Exception | None) -> None:
        """Release the slot."""
        self._slot.release()
        self._stop_waiting()
        super().connection_lost(exc)

    def data_received(self, data: bytes) -> None:
        """Take bytes; any number of small pieces does not extend the time limit."""
        super().data_received(data)
        self._await_head()

    def on_response_complete(self) -> None:
        """Start to wait for the next request."""
        self._stop_waiting()
        super().on_response_complete()
        self._await_head()

    def handle_websocket_upgrade(self, event: h11.Request) -> None:
        """Pass slot and connection on to the WebSocket."""
        self._stop_waiting()
        super().handle_websocket_upgrade(event)
        websocket = self.transport.get_protocol()
        assert isinstance(websocket, BoundedWebSocket)
        websocket.slot = self._slot

    def _await_head(self) -> None:
        is_answering = self.cycle is not None and not self.cycle.response_complete
        if is_answering or self.transport.is_closing():
            self._stop_waiting()
        elif self._head_timer is None and self.transport.get_protocol() is self:
            self._head_timer = self.loop.call_later(self.bounds.head_within_s, self.transport.abort)

    def _stop_waiting(self) -> None:
        if self._head_timer is not None:
            self._head_timer.cancel()
            self._head_timer = None


class BoundedWebSocket(WebSocketsSansIOProtocol):
    """Serve a WebSocket in the slot of the connection that was upgraded."""

    slot: ConnectionSlot | None = None

    def connection_lost(self, exc: Exception | None) -> None:
        """Release the slot."""
        if self.slot is not None:
            self.slot.release()
        super().connection_lost(exc)


def _is_welcome(transport: asyncio.Transport) -> bool:
    """Return whether a connection is of the network, or by the Unix socket from the own user."""
    connection = transport.get_extra_info("socket")
    return connection.family != socket.AF_UNIX or is_own_user(connection)


def bounded_by(connections: Connections) -> type[BoundedHttp]:
    """Return the HTTP protocol whose connections count together."""
    return type("BoundedHttp", (BoundedHttp,), {"bounds": connections})
