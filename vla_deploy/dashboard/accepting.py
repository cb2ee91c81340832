"""Accept connections of one listening socket within bounds, also while no descriptor is left.

asyncio accepts whatever comes, counts nothing, and when descriptors run out schedules itself again
for each of the 128 connections that might wait, for good.
"""

import asyncio
import errno
import logging
import socket
import ssl
import struct
from collections.abc import Callable
from itertools import islice
from typing import Final

from vla_deploy.client.peer_credentials import is_own_user
from vla_deploy.dashboard.access.body import STOP_BYTES
from vla_deploy.dashboard.access.connections import (
    BoundedHttp,
    Connections,
    ConnectionSlot,
    Press,
    pressed_by,
)
from vla_deploy.dashboard.access.identity import SOCKET, Peer, peer_at

HANDSHAKE_WITHIN_S: Final = 5.0
PAUSE_S: Final = 0.25
_ACCEPTED_AT_ONCE: Final = 64
"""To accept one, and to see whether it is a press, takes a twentieth of a millisecond."""
_OPENED_AT_ONCE: Final = 4
"""To serve one takes a millisecond, with a TLS handshake two: the others wait for their turn."""
_LAST_LOOK_S: Final = 0.05
_MOST_REFUSED: Final = 32
_FULL: Final = frozenset({errno.EMFILE, errno.ENFILE, errno.ENOBUFS, errno.ENOMEM})
_RESET: Final = struct.pack("ii", 1, 0)  # SO_LINGER of no time: an early refusal keeps nothing
_log = logging.getLogger(__name__)


class Acceptor:
    """Accept connections, refuse early those that find no room, and count TLS handshakes, too."""

    def __init__(
        self,
        listener: socket.socket,
        tls: ssl.SSLContext | None,
        make_protocol: Callable[[], BoundedHttp],
        connections: Connections,
        press: Press,
    ) -> None:
        """Accept nothing yet; `press` presses the stop."""
        listener.setblocking(False)
        self._listener = listener
        self._tls = tls
        self._make_protocol = make_protocol
        self._connections = connections
        self._press = press
        self._loop = asyncio.get_running_loop()
        self._accepted: dict[ConnectionSlot, socket.socket] = {}
        self._opening: set[asyncio.Task[None]] = set()
        self._pause: asyncio.TimerHandle | None = None
        self._is_full = False
        self._refused = 0

    def start(self) -> None:
        """Accept from now on."""
        self._pause = None
        self._loop.add_reader(self._listener.fileno(), self._accept)

    def close(self) -> None:
        """Accept no more, and drop what is not open yet; closing twice is allowed."""
        if self._listener.fileno() >= 0:
            self._loop.remove_reader(self._listener.fileno())
        if self._pause is not None:
            self._pause.cancel()
        for task in self._opening:
            task.cancel()
        for slot in [*self._accepted]:
            slot.release()
            self._forget(slot)

    def _accept(self) -> None:
        for _ in range(_ACCEPTED_AT_ONCE):
            try:
                connection, address = self._listener.accept()
            except (BlockingIOError, InterruptedError, ConnectionAbortedError):
                return
            except OSError as error:
                if error.errno not in _FULL:
                    raise
                self._rest(error)
                return
            self._is_full = False
            self._take(connection, address)

    def _rest(self, error: OSError) -> None:
        """Accept nothing for a moment: the kernel goes on to say that connections wait."""
        if not self._is_full:
            _log.error("no connection is accepted for %g s at a time: %s", PAUSE_S, error)
        self._is_full = True
        self._connections.make_room()
        self._loop.remove_reader(self._listener.fileno())
        self._pause = self._loop.call_later(PAUSE_S, self.start)

    def _take(self, connection: socket.socket, address: object) -> None:
        peer = _peer(connection, address)
        # Before anything else is done with it, and where there is no room, too.
        is_pressed = peer is not None and self._tls is None and self._is_press(connection)
        slot = None if peer is None else self._connections.enter(peer, lambda: None)
        if slot is None:
            self._refuse(connection, may_press=peer is not None and not is_pressed)
            return
        slot.has_pressed = is_pressed
        connection.setblocking(False)
        slot.drop = lambda: self._forget(slot)
        if not self._accepted:
            self._loop.call_soon(self._open_some)
        self._accepted[slot] = connection

    def _forget(self, slot: ConnectionSlot) -> None:
        connection = self._accepted.pop(slot, None)
        if connection is not None:
            _reset(connection)

    def _open_some(self) -> None:
        """Open the oldest accepted connections, and leave the others to the next turn."""
        for slot in [*islice(self._accepted, _OPENED_AT_ONCE)]:
            self._begin(self._accepted.pop(slot), slot)
        if self._accepted:
            self._loop.call_soon(self._open_some)

    def _begin(self, connection: socket.socket, slot: ConnectionSlot) -> None:
        task = self._loop.create_task(self._open(connection, slot))

        def end(done: asyncio.Task[None]) -> None:
            self._opening.discard(done)
            error = None if done.cancelled() else done.exception()
            if error is not None and not isinstance(error, OSError):  # which are gone, or no TLS
                _log.error("a connection failed: %r", error)
            if done.cancelled() or error is not None:
                slot.release()
                connection.close()

        def drop() -> None:
            task.cancel()  # maybe before its first step, where nothing of it can clean up

        slot.drop = drop
        self._opening.add(task)
        task.add_done_callback(end)

    def _refuse(self, connection: socket.socket, *, may_press: bool) -> None:
        """Reset a connection; one without TLS gets a moment before, in which a press may come."""
        if may_press and self._tls is None and self._refused < _MOST_REFUSED:
            self._refused += 1
            self._loop.call_later(_LAST_LOOK_S, self._look_and_reset, connection)
        else:
            _reset(connection)

    def _look_and_reset(self, connection: socket.socket) -> None:
        self._refused -= 1
        self._is_press(connection)
        _reset(connection)

    def _is_press(self, connection: socket.socket) -> bool:
        """Press where a press has come with the connection; its bytes stay for who serves it."""
        try:
            data = connection.recv(STOP_BYTES, socket.MSG_PEEK | socket.MSG_DONTWAIT)
        except OSError:
            return False
        return pressed_by(data, self._press)

    async def _open(self, connection: socket.socket, slot: ConnectionSlot) -> None:
        """Let a protocol serve the connection, after its TLS handshake where there is one."""

        def serving() -> BoundedHttp:
            protocol = self._make_protocol()
            protocol.slot = slot
            return protocol

        limit_s = None if self._tls is None else HANDSHAKE_WITHIN_S
        await self._loop.connect_accepted_socket(
            serving, connection, ssl=self._tls, ssl_handshake_timeout=limit_s
        )


def _reset(connection: socket.socket) -> None:
    connection.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, _RESET)
    connection.close()


def _peer(connection: socket.socket, address: object) -> Peer | None:
    """Return the other end, None where it may not be there: another user at the Unix socket."""
    if connection.family == socket.AF_UNIX:
        local = Peer(address=SOCKET, is_loopback=False, is_socket=True)
        return local if is_own_user(connection) else None
    return peer_at(str(address[0]) if isinstance(address, tuple) else "")
