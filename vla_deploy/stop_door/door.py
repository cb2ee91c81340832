"""Listen, and let every client be served beside all others: one thread, no client is waited for."""

import errno
import logging
import selectors
import socket
from collections import Counter
from collections.abc import Callable, Collection
from typing import Final

from drivers.clock import Clock
from vla_deploy.stop_door.connection import Answer, Connection, Stage
from vla_deploy.stop_door.listener import Listener

MAX_CONNECTIONS: Final = 128
_ACCEPTED_AT_ONCE: Final = 32
_FULL: Final = frozenset({errno.EMFILE, errno.ENFILE, errno.ENOBUFS, errno.ENOMEM})
_log = logging.getLogger(__name__)


class Door:
    """Hold the listening socket and the clients."""

    def __init__(self, listener: Listener, answer: Callable[[str], Answer], clock: Clock) -> None:
        """Listen; `answer` gives, for a peer's address, what makes the answer to its request."""
        self.accepted = 0
        self.crowded_out = 0
        self.expired = 0
        self.lost = 0
        self._listener = listener
        self._answer = answer
        self._clock = clock
        self._selector = selectors.DefaultSelector()
        self._selector.register(listener.socket, selectors.EVENT_READ)
        self._connections: list[Connection] = []

    @property
    def connections(self) -> int:
        """Return how many clients there are."""
        return len(self._connections)

    def serve(self, wait_s: float) -> None:
        """Wait for clients, and do for each what can be done at once."""
        for key, _ in self._selector.select(wait_s):
            if key.data is None:
                self._accept()
            else:
                self._proceed(key.data)
        now_ns = self._clock.now_ns()
        for late in [one for one in self._connections if now_ns >= one.deadline_ns]:
            self.expired += late.stage is Stage.READING
            late.expire(now_ns)
            self._look_after(late)

    def close(self) -> None:
        """Close the listening socket and every connection."""
        for one in self._connections:
            self._selector.unregister(one.socket)
            one.close()
        self._connections.clear()
        self._selector.close()
        self._listener.close()

    def _accept(self) -> None:
        for _ in range(_ACCEPTED_AT_ONCE):
            try:
                client, peer = self._listener.accept()
            except BlockingIOError:
                return
            except OSError as error:
                if error.errno in _FULL:
                    _log.warning("no room for a connection: %s", error)
                    self._make_room()
                    return
                self.lost += 1  # it has gone before it was taken
                continue
            self.accepted += 1
            if self.connections >= MAX_CONNECTIONS:
                self._make_room()
            self._take(client, peer)

    def _take(self, client: socket.socket, peer: str) -> None:
        connection = Connection(client, peer, self._answer(peer), self._clock.now_ns())
        self._selector.register(client, connection.interest, connection)
        self._connections.append(connection)
        self._proceed(connection)

    def _make_room(self) -> None:
        if not self._connections:
            return
        victim = who_makes_room(self._connections)
        self.crowded_out += 1
        self._drop(victim)

    def _proceed(self, connection: Connection) -> None:
        if connection.stage is Stage.CLOSED:  # it has made room for another since the selector woke
            return
        connection.proceed(self._clock.now_ns())
        self._look_after(connection)

    def _look_after(self, connection: Connection) -> None:
        if connection.stage is Stage.CLOSED:
            self._drop(connection)
        else:
            self._selector.modify(connection.socket, connection.interest, connection)

    def _drop(self, connection: Connection) -> None:
        self._selector.unregister(connection.socket)
        self._connections.remove(connection)
        connection.close()


def who_makes_room(connections: Collection[Connection]) -> Connection:
    """Return the oldest connection of the address that has most of them: a flood hurts itself."""
    by_peer = Counter(one.peer for one in connections)
    most = max(by_peer.values())
    return next(one for one in connections if by_peer[one.peer] == most)
