"""Bound how many connections there are, and how long one may take to ask for something.

uvicorn waits for ever for the first bytes of a request, which is all that a slow-loris needs.
"""

import asyncio
from collections import Counter
from typing import Any, Final

import h11
from uvicorn.protocols.http.h11_impl import H11Protocol
from uvicorn.protocols.websockets.websockets_sansio_impl import WebSocketsSansIOProtocol

from vla_deploy.dashboard.access.peer import Peer, peer_of

MOST: Final = 256
"""Of all addresses together; this computer's own connections are always let in besides."""
MOST_PER_HOME: Final = 32
HEAD_WITHIN_S: Final = 10.0
HEAD_BYTES: Final = 32 * 1024


class Connections:
    """Count open connections by where they come from."""

    def __init__(
        self,
        most: int = MOST,
        most_per_home: int = MOST_PER_HOME,
        head_within_s: float = HEAD_WITHIN_S,
    ) -> None:
        """Begin without any; `head_within_s` is how long a connection may ask for nothing."""
        self.head_within_s = head_within_s
        self._most = most
        self._most_per_home = most_per_home
        self._by_home: Counter[str] = Counter()

    @property
    def held(self) -> int:
        """Return how many there are, those of this computer left out."""
        return self._by_home.total()

    def enter(self, peer: Peer) -> bool:
        """Count one more, or return False where there are enough."""
        if not (peer.is_loopback or peer.is_socket):
            is_full = self.held >= self._most
            if is_full or self._by_home[peer.home] >= self._most_per_home:
                return False
            self._by_home[peer.home] += 1
        return True

    def leave(self, peer: Peer) -> None:
        """Count one less."""
        self._by_home[peer.home] -= 1
        if self._by_home[peer.home] <= 0:
            del self._by_home[peer.home]


class Place:
    """Hold the place of one connection, across its change from HTTP to WebSocket."""

    def __init__(self, connections: Connections, protocol: Any) -> None:
        self._connections = connections
        self._peer = peer_of({"server": protocol.server, "client": protocol.client})
        self.is_held = connections.enter(self._peer)

    def give_up(self) -> None:
        """Leave, once."""
        if self.is_held:
            self.is_held = False
            self._connections.leave(self._peer)


class BoundedHttp(H11Protocol):
    """Speak HTTP/1.1; hang up on who does not finish a request's head in time."""

    bounds: Connections

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
        """Take a place, or hang up at once."""
        super().connection_made(transport)
        self._place = Place(self.bounds, self)
        self._head_timer: asyncio.TimerHandle | None = None
        if self._place.is_held:
            self._await_head()
        else:
            transport.abort()

    def connection_lost(self, exc: Exception | None) -> None:
        """Leave the place to another."""
        self._place.give_up()
        self._stop_waiting()
        super().connection_lost(exc)

    def data_received(self, data: bytes) -> None:
        """Take bytes; as many small ones as one likes do not extend the time for a head."""
        super().data_received(data)
        self._await_head()

    def on_response_complete(self) -> None:
        """Begin to wait for the next request."""
        self._stop_waiting()
        super().on_response_complete()
        self._await_head()

    def handle_websocket_upgrade(self, event: h11.Request) -> None:
        """Hand place and connection over to the WebSocket."""
        self._stop_waiting()
        super().handle_websocket_upgrade(event)
        websocket = self.transport.get_protocol()
        assert isinstance(websocket, BoundedWebSocket)
        websocket.place = self._place

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
    """Speak WebSocket in the place of the connection that asked for it."""

    place: Place | None = None

    def connection_lost(self, exc: Exception | None) -> None:
        """Leave the place to another."""
        if self.place is not None:
            self.place.give_up()
        super().connection_lost(exc)


def bounded_by(connections: Connections) -> type[BoundedHttp]:
    """Return the protocol of HTTP whose connections are counted together."""
    return type("BoundedHttp", (BoundedHttp,), {"bounds": connections})
