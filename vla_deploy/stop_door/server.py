"""Serve many clients in one thread; no client is waited for."""

import errno
import logging
import re
import selectors
import socket
import ssl
from collections import Counter
from collections.abc import Callable, Collection
from enum import Enum
from typing import Final

from drivers.clock import NS_PER_S, Clock
from vla_deploy.runtime.net import (
    DashboardSettings,
    PortTaken,
    open_port,
    server_context,
)

MAX_HEAD_BYTES: Final = 16_384
"""Room for the cookies that a browser sends along for every other port of the same host."""
READ_NS: Final = 2 * NS_PER_S
WRITE_NS: Final = 2 * NS_PER_S
LINGER_NS: Final = NS_PER_S
_HEAD_END: Final = re.compile(rb"\r?\n\r?\n")  # bare line ends, too, as a person types them
_LINE_END: Final = b"\n"
_CHUNK_BYTES: Final = 16_384
"""A whole TLS record, so that no rest of one stays where no selector sees it."""
_ACTS_AT_ONCE: Final = 8
"""After these the other clients get their turn, however fast one sends."""


MAX_CONNECTIONS: Final = 128
_ACCEPTED_AT_ONCE: Final = 32
_FULL: Final = frozenset({errno.EMFILE, errno.ENFILE, errno.ENOBUFS, errno.ENOMEM})
_MAPPED: Final = "::ffff:"
_log = logging.getLogger(__name__)
Responder = Callable[[bytes, bool], bytes]
"""Makes the answer from a head, and from whether the head is whole."""


class ConnectionStage(Enum):
    """Name the stages of a connection."""

    READING = "reading"
    ANSWERING = "answering"
    LINGERING = "lingering"
    CLOSED = "closed"


class Connection:
    """Carry one request and its answer.

    `interest` is what the selector waits for. The body of a request is ignored: it is read while
    the client reads the answer, which closing at once would destroy.
    """

    def __init__(self, client: socket.socket, peer: str, answer: Responder, now_ns: int) -> None:
        self.peer = peer
        self.socket = client
        self.stage = ConnectionStage.READING
        self.interest = selectors.EVENT_READ
        self.deadline_ns = now_ns + READ_NS
        self._answer = answer
        self._head = bytearray()
        self._unsent = memoryview(b"")

    def proceed(self, now_ns: int) -> None:
        """Read or write what needs no waiting; close if the client has gone."""
        try:
            for _ in range(_ACTS_AT_ONCE):
                if self.stage is ConnectionStage.CLOSED:
                    return
                self._act(now_ns)
            self.interest = self._wanted()
        except ssl.SSLWantWriteError:
            self.interest = selectors.EVENT_WRITE
        except ssl.SSLWantReadError:
            self.interest = selectors.EVENT_READ
        except BlockingIOError:
            self.interest = self._wanted()
        except OSError:  # reset, or no TLS: there is no client to answer
            self.close()

    def expire(self, now_ns: int) -> None:
        """Answer a request line whose head never became whole; close everything else."""
        if self.stage is ConnectionStage.READING and _LINE_END in self._head:
            self._conclude(now_ns, whole=False)
            self.proceed(now_ns)
        else:
            self.close()

    def close(self) -> None:
        """Close the connection; closing twice is allowed."""
        self.stage = ConnectionStage.CLOSED
        self.socket.close()

    def _wanted(self) -> int:
        answering = self.stage is ConnectionStage.ANSWERING
        return selectors.EVENT_WRITE if answering else selectors.EVENT_READ

    def _act(self, now_ns: int) -> None:
        if self.stage is ConnectionStage.READING:
            self._read(now_ns)
        elif self.stage is ConnectionStage.ANSWERING:
            self._write(now_ns)
        elif not self.socket.recv(_CHUNK_BYTES):
            self.close()

    def _read(self, now_ns: int) -> None:
        received = self.socket.recv(_CHUNK_BYTES)
        self._head += received
        if _HEAD_END.search(self._head):
            self._conclude(now_ns, whole=True)
        elif len(self._head) > MAX_HEAD_BYTES:
            self._conclude(now_ns, whole=False)
        elif not received:
            self.expire(now_ns)

    def _conclude(self, now_ns: int, *, whole: bool) -> None:
        head = _HEAD_END.split(self._head, 1)[0]
        self._head.clear()
        self._unsent = memoryview(self._answer(head, whole))
        self.stage, self.deadline_ns = ConnectionStage.ANSWERING, now_ns + WRITE_NS

    def _write(self, now_ns: int) -> None:
        self._unsent = self._unsent[self.socket.send(self._unsent) :]
        if not self._unsent:
            self.socket.shutdown(socket.SHUT_WR)
            self.stage, self.deadline_ns = ConnectionStage.LINGERING, now_ns + LINGER_NS


class ListeningSocket:
    """Accept clients from a listening socket, plain or TLS, without waiting."""

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
        """Return a client's socket, which does not block either, and its address.

        Raises:
            BlockingIOError: no client waits.
            OSError: the client has gone, or no descriptor is left.
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
) -> ListeningSocket:
    """Listen where the settings say; `search` and `before` are those of `open_port`.

    Raises:
        PortTaken: the address is in use, or not this computer's.
        TlsUnusable: certificate or key cannot be used.
    """
    certificate, key = settings.tls_certificate, settings.tls_key
    tls = server_context(certificate, key) if certificate else None
    try:
        listening = open_port(settings.host, settings.stop_port, search=search, before=before)
    except (PortTaken, OSError) as error:
        raise PortTaken(f"stop_port: {error}") from error
    return ListeningSocket(listening, tls)


def _secured(client: socket.socket, tls: ssl.SSLContext) -> ssl.SSLSocket:
    try:
        client.getpeername()
    except OSError:  # it has gone; wrap_socket would fail, too, but leave it open
        client.close()
        raise
    return tls.wrap_socket(client, server_side=True, do_handshake_on_connect=False)


class StopServer:
    """Serve the clients of one listening socket."""

    def __init__(
        self, listener: ListeningSocket, responder: Callable[[str], Responder], clock: Clock
    ) -> None:
        """Start to listen; `responder` returns, for a peer's address, what answers its request."""
        self.accepted = 0
        self.crowded_out = 0
        self.expired = 0
        self.lost = 0
        self._listener = listener
        self._responder = responder
        self._clock = clock
        self._selector = selectors.DefaultSelector()
        self._selector.register(listener.socket, selectors.EVENT_READ)
        self._connections: list[Connection] = []

    @property
    def connections(self) -> int:
        """Return how many clients there are."""
        return len(self._connections)

    def serve(self, wait_s: float) -> None:
        """Wait for clients, and serve each of them without waiting."""
        for key, _ in self._selector.select(wait_s):
            if key.data is None:
                self._accept()
            else:
                self._proceed(key.data)
        now_ns = self._clock.now_ns()
        for late in [one for one in self._connections if now_ns >= one.deadline_ns]:
            self.expired += late.stage is ConnectionStage.READING
            late.expire(now_ns)
            self._update(late)

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
                self.lost += 1  # the client has gone already
                continue
            self.accepted += 1
            if self.connections >= MAX_CONNECTIONS:
                self._make_room()
            self._take(client, peer)

    def _take(self, client: socket.socket, peer: str) -> None:
        connection = Connection(client, peer, self._responder(peer), self._clock.now_ns())
        self._selector.register(client, connection.interest, connection)
        self._connections.append(connection)
        self._proceed(connection)

    def _make_room(self) -> None:
        if not self._connections:
            return
        self.crowded_out += 1
        self._drop(_victim(self._connections))

    def _proceed(self, connection: Connection) -> None:
        if connection.stage is ConnectionStage.CLOSED:  # to make room, since the selector woke
            return
        connection.proceed(self._clock.now_ns())
        self._update(connection)

    def _update(self, connection: Connection) -> None:
        if connection.stage is ConnectionStage.CLOSED:
            self._drop(connection)
        else:
            self._selector.modify(connection.socket, connection.interest, connection)

    def _drop(self, connection: Connection) -> None:
        self._selector.unregister(connection.socket)
        self._connections.remove(connection)
        connection.close()


def _victim(connections: Collection[Connection]) -> Connection:
    """Return the oldest connection of the address that has most: a flood displaces itself."""
    by_peer = Counter(one.peer for one in connections)
    most = max(by_peer.values())
    return next(one for one in connections if by_peer[one.peer] == most)
