"""Limit the number of connections, and the time that a request's head may take.

uvicorn waits without limit for a request's first bytes, which is all that a slow-loris needs.
"""

import asyncio
from collections import Counter
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from enum import Enum
from typing import Any, Final, Self

import h11
from uvicorn.protocols.http.h11_impl import H11Protocol
from uvicorn.protocols.websockets.websockets_sansio_impl import WebSocketsSansIOProtocol

from vla_deploy.dashboard.access.body import reason_in
from vla_deploy.dashboard.access.identity import Peer
from vla_deploy.dashboard.access.request import STOP_PATH

HEAD_WITHIN_S: Final = 10.0
HEAD_BYTES: Final = 32 * 1024
STOP_REQUEST: Final = f"POST {STOP_PATH} ".encode()
PRESSED: Final = "is_stop_pressed"
"""The key of a request's state: its route need not press again."""
_HEAD_END: Final = b"\r\n\r\n"
_LEAST: Final = 4


Press = Callable[[str], bool]
"""Press the stop with a reason; return whether it is pressed."""


def pressed_by(data: bytes, press: Press) -> bool:
    """Press where a request begins as a stop does; return whether it is pressed."""
    return data.startswith(STOP_REQUEST) and press(reason_in(data.partition(_HEAD_END)[2]))


class PeerGroup(Enum):
    """Name from where connections come; none takes the places of another."""

    NETWORK = "network"
    LOOPBACK = "loopback"
    SOCKET = "socket"

    @classmethod
    def of(cls, peer: Peer) -> "PeerGroup":
        """Return the group of a peer."""
        if peer.is_socket:
            return cls.SOCKET
        return cls.LOOPBACK if peer.is_loopback else cls.NETWORK


MOST: Final[Mapping[PeerGroup, int]] = {
    PeerGroup.NETWORK: 256,
    PeerGroup.LOOPBACK: 256,
    PeerGroup.SOCKET: 64,
}
MOST_PER_ADDRESS: Final = 32
"""Of the network: loopback is one address for all users, pages and proxies of this computer."""


class ConnectionSlot:
    """Hold the place of one connection, across its upgrade from HTTP to WebSocket."""

    def __init__(self, connections: "Connections", peer: Peer, drop: Callable[[], None]) -> None:
        self.key = peer.rate_key
        self.group = PeerGroup.of(peer)
        self.is_waiting = True
        """It waits for its client, to ask or to take an answer: then it gives way to another."""
        self.has_pressed = False
        """The stop that it begins with has been pressed already."""
        self.drop = drop
        self._connections = connections

    def release(self) -> None:
        """Count the connection no more; calling it twice is allowed."""
        self._connections.leave(self)


@dataclass(frozen=True, slots=True, kw_only=True)
class ConnectionLimits:
    """Set how many connections there may be, of each group and of one address of the network."""

    most: Mapping[PeerGroup, int]
    per_address: int = MOST_PER_ADDRESS

    @classmethod
    def within(cls, open_files: int) -> Self:
        """Return the usual limits, or less where this process may not open that many files."""
        ratio = min(1.0, open_files / sum(MOST.values()))
        return cls(most={group: max(_LEAST, int(most * ratio)) for group, most in MOST.items()})


class Connections:
    """Hold the places of open connections, from before the TLS handshake to the end.

    Where there is no room, the oldest one that waits for its client gives way: who keeps
    connections open and idle keeps nobody out.
    """

    def __init__(
        self, limits: ConnectionLimits | None = None, head_within_s: float = HEAD_WITHIN_S
    ) -> None:
        """Start without any; `head_within_s` is the time limit for a request's head."""
        self.head_within_s = head_within_s
        self.refused = 0
        self.crowded_out = 0
        self._limits = limits or ConnectionLimits(most=MOST)
        self._slots: dict[ConnectionSlot, None] = {}

    @property
    def held(self) -> int:
        """Return how many there are."""
        return len(self._slots)

    def enter(self, peer: Peer, drop: Callable[[], None]) -> ConnectionSlot | None:
        """Return a place, or None where there is no room; `drop` ends the connection at once."""
        slot = ConnectionSlot(self, peer, drop)
        if not self._has_room(slot):
            self.refused += 1
            return None
        self._slots[slot] = None
        return slot

    def leave(self, slot: ConnectionSlot) -> None:
        """Count one less."""
        self._slots.pop(slot, None)

    def make_room(self) -> None:
        """End the oldest waiting connection of the address that holds most, to free a file."""
        self._crowd_out([*self._slots])

    def _has_room(self, new: ConnectionSlot) -> bool:
        fellows = [one for one in self._slots if one.group is new.group]
        if new.group is PeerGroup.NETWORK:
            own = [one for one in fellows if one.key == new.key]
            if len(own) >= self._limits.per_address and not self._crowd_out(own):
                return False
        is_full = len(fellows) >= self._limits.most[new.group]
        return not is_full or self._crowd_out(fellows)

    def _crowd_out(self, slots: list[ConnectionSlot]) -> bool:
        waiting = [one for one in slots if one.is_waiting]
        if not waiting:
            return False
        by_key = Counter(one.key for one in waiting)
        victim = max(waiting, key=lambda one: by_key[one.key])  # the first: the oldest
        self.crowded_out += 1
        victim.release()
        victim.drop()
        return True


class BoundedHttp(H11Protocol):
    """Serve HTTP/1.1; abort connections whose request head is not complete in time."""

    bounds: Connections
    slot: ConnectionSlot
    press: Press

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
        """Wait for the first request."""
        super().connection_made(transport)
        self.slot.drop = transport.abort
        self._head_timer: asyncio.TimerHandle | None = None
        self._await_head()

    def connection_lost(self, exc: Exception | None) -> None:
        """Release the slot."""
        self.slot.release()
        self._stop_waiting()
        super().connection_lost(exc)

    def data_received(self, data: bytes) -> None:
        """Take bytes; any number of small pieces does not extend the time limit.

        A stop is pressed before anything else is done with it, also before the requests ahead of
        it are answered; its route answers it when its turn comes.
        """
        is_pressed = self.slot.has_pressed or pressed_by(data, self.press)
        self.slot.has_pressed = False
        before = self.app_state
        self.app_state = {**before, PRESSED: is_pressed}
        super().data_received(data)  # which begins the request, with this state
        self.app_state = before
        self._await_head()

    def pause_writing(self) -> None:
        """Note that the client takes nothing."""
        self.slot.is_waiting = True
        super().pause_writing()

    def resume_writing(self) -> None:
        """Note that the client takes something again."""
        self.slot.is_waiting = False
        super().resume_writing()

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
        websocket.slot = self.slot

    def _await_head(self) -> None:
        is_answering = self.cycle is not None and not self.cycle.response_complete
        if is_answering or self.transport.is_closing():
            self._stop_waiting()
        elif self._head_timer is None and self.transport.get_protocol() is self:
            self.slot.is_waiting = True
            self._head_timer = self.loop.call_later(self.bounds.head_within_s, self.transport.abort)

    def _stop_waiting(self) -> None:
        self.slot.is_waiting = False
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


def bounded_by(connections: Connections, press: Press) -> type[BoundedHttp]:
    """Return the HTTP protocol whose connections count together; `press` presses the stop."""
    fields: dict[str, Any] = {"bounds": connections, "press": staticmethod(press)}
    return type("BoundedHttp", (BoundedHttp,), fields)
