"""Serve one application at several sockets, and step the node, in one event loop."""

import asyncio
import contextlib
import logging
import socket
import ssl
import sys
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import anyio.to_thread
import uvicorn
from starlette.types import ASGIApp

from drivers.clock import NS_PER_S, Clock
from drivers.twin_clock import TwinClock
from vla_deploy.dashboard.accepting import Acceptor
from vla_deploy.dashboard.access.connections import (
    HEAD_BYTES,
    BoundedHttp,
    ConnectionLimits,
    Connections,
    Press,
    bounded_by,
)
from vla_deploy.dashboard.door_probe import DoorProbe
from vla_deploy.dashboard.live.endpoint import LiveProtocol
from vla_deploy.ipc.memory.doorbell import short_path
from vla_deploy.runtime.net import BACKLOG, PortTaken
from vla_deploy.runtime.node import Node
from vla_deploy.runtime.open_files import open_files_left

_SOCKET_MODE: Final = 0o660
_SHUTDOWN_S: Final = 1  # for open requests
_KEEP_ALIVE_S: Final = 10
_THREADS: Final = 3
"""Of answers that read slow disks: each takes the interpreter from the event loop for a moment."""
_SWITCH_S: Final = 0.001
_OWN_FILES: Final = 64  # which answers open meanwhile: logs, recordings, topics
_MOST_MESSAGE_BYTES: Final = 1_000_000


def open_socket(path: Path) -> socket.socket:
    """Listen at a Unix socket, which only owner and group may use.

    Raises:
        PortTaken: it cannot be created.
    """
    listening = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
    try:
        path.unlink(missing_ok=True)  # an earlier instance of this run left it
        with short_path(path.parent) as folder:
            listening.bind(f"{folder}/{path.name}")
        path.chmod(_SOCKET_MODE)
    except OSError as error:
        listening.close()
        raise PortTaken(f"{path}: cannot listen there: {error}") from error
    listening.listen(BACKLOG)
    return listening


@dataclass(frozen=True, slots=True)
class HttpSocket:
    """Hold a listening socket with its TLS context."""

    listener: socket.socket
    tls: ssl.SSLContext | None = None


class _Server(uvicorn.Server):
    """Leave signals to the process's main function, and accepting to an acceptor within bounds."""

    def __init__(
        self,
        config: uvicorn.Config,
        at: HttpSocket,
        bounds: Connections,
        press: Press,
    ) -> None:
        super().__init__(config)
        self._at = at
        self._bounds = bounds
        self._press = press

    @contextlib.contextmanager
    def capture_signals(self) -> Iterator[None]:
        yield

    async def startup(self, sockets: list[socket.socket] | None = None) -> None:
        """Accept connections."""
        await self.lifespan.startup()
        protocol = bounded_by(self._bounds, self._press)

        def make_protocol() -> BoundedHttp:
            return protocol(self.config, self.server_state, self.lifespan.state)

        self.servers = []  # uvicorn's own would accept without bounds
        self._acceptor = Acceptor(
            self._at.listener, self._at.tls, make_protocol, self._bounds, self._press
        )
        self._acceptor.start()
        self.started = True

    async def shutdown(self, sockets: list[socket.socket] | None = None) -> None:
        """Accept no more, and let open requests end."""
        self._acceptor.close()
        await super().shutdown(sockets)


async def serve(
    app: ASGIApp,
    sockets: Sequence[HttpSocket],
    node: Node,
    clock: Clock,
    should_stop: Callable[[], bool],
    connections: Connections | None = None,
    probe: DoorProbe | None = None,
    press: Press = lambda _: False,
) -> None:
    """Answer requests and step a started node until `should_stop()`; `probe` asks meanwhile.

    `press` presses the stop, ahead of the requests that wait.
    """
    anyio.to_thread.current_default_thread_limiter().total_tokens = _THREADS
    sys.setswitchinterval(_SWITCH_S)
    bounds = connections or Connections(ConnectionLimits.within(open_files_left() - _OWN_FILES))
    servers = [_Server(_config(app), one, bounds, press) for one in sockets]
    probing = None if probe is None else asyncio.create_task(probe.run())
    serving = [
        asyncio.create_task(server.serve([one.listener]))
        for server, one in zip(servers, sockets, strict=True)
    ]
    try:
        await _step(node, clock, lambda: should_stop() or any(task.done() for task in serving))
    finally:
        if probing is not None:
            probing.cancel()
        for server in servers:
            server.should_exit = True
        await asyncio.gather(*serving)


async def _step(node: Node, clock: Clock, should_stop: Callable[[], bool]) -> None:
    """Step on absolute deadlines, as `run_node` does; skip periods that were missed."""
    deadline_ns = clock.now_ns()
    while not should_stop():
        node.step()
        if isinstance(clock, TwinClock):
            clock.release()  # requests are answered in real time; the twin does not wait
        period_ns = round(node.period_s * NS_PER_S)
        deadline_ns = max(deadline_ns + period_ns, clock.now_ns())
        await asyncio.sleep((deadline_ns - clock.now_ns()) / NS_PER_S)


def _config(app: ASGIApp) -> uvicorn.Config:
    return uvicorn.Config(
        app,
        log_config=None,
        log_level=logging.ERROR,  # a warning for each request that is none would fill the disk
        access_log=False,
        lifespan="off",
        loop="asyncio",
        ws=LiveProtocol,
        ws_per_message_deflate=False,  # else each message is compressed for each client
        proxy_headers=False,
        server_header=False,
        h11_max_incomplete_event_size=HEAD_BYTES,
        timeout_keep_alive=_KEEP_ALIVE_S,
        timeout_graceful_shutdown=_SHUTDOWN_S,
        ws_max_size=_MOST_MESSAGE_BYTES,
    )
