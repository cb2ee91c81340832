"""Serve one application at several sockets, and step the node, in one event loop."""

import asyncio
import contextlib
import logging
import socket
import ssl
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import uvicorn
from starlette.types import ASGIApp

from drivers.clock import NS_PER_S, Clock
from drivers.twin_clock import TwinClock
from vla_deploy.dashboard.access.connections import (
    HEAD_BYTES,
    Connections,
    bounded_by,
)
from vla_deploy.dashboard.live.endpoint import LiveProtocol
from vla_deploy.ipc.doorbell import short_path
from vla_deploy.runtime.net import BACKLOG, PortTaken
from vla_deploy.runtime.node import Node

SOCKET_NAME: Final = "dashboard.sock"
_SOCKET_MODE: Final = 0o660


def open_socket(path: Path) -> socket.socket:
    """Listen at a Unix socket, which only owner and group may use.

    Raises:
        PortTaken: it cannot be made.
    """
    door = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
    try:
        path.unlink(missing_ok=True)  # an earlier instance of this run left it
        with short_path(path.parent) as folder:
            door.bind(f"{folder}/{path.name}")
        path.chmod(_SOCKET_MODE)
    except OSError as error:
        door.close()
        raise PortTaken(f"{path}: cannot listen there: {error}") from error
    door.listen(BACKLOG)
    return door


GOODBYE_S: Final = 1  # for requests that are under way at the end
_KEEP_ALIVE_S: Final = 10
_MOST_MESSAGE_BYTES: Final = 1_000_000


@dataclass(frozen=True, slots=True)
class Door:
    """Name a listening socket, and what it encrypts with."""

    name: str
    listener: socket.socket
    tls: ssl.SSLContext | None = None


class _Server(uvicorn.Server):
    """Leave the process' signals to whoever runs it."""

    @contextlib.contextmanager
    def capture_signals(self) -> Iterator[None]:
        yield


def serve(
    app: ASGIApp,
    doors: Sequence[Door],
    node: Node,
    clock: Clock,
    should_stop: Callable[[], bool],
    connections: Connections | None = None,
) -> None:
    """Answer requests and step a started node until `should_stop()`."""
    asyncio.run(_serve(app, doors, node, clock, should_stop, connections or Connections()))


async def _serve(
    app: ASGIApp,
    doors: Sequence[Door],
    node: Node,
    clock: Clock,
    should_stop: Callable[[], bool],
    connections: Connections,
) -> None:
    servers = [_Server(_config(app, door, connections)) for door in doors]
    serving = [
        asyncio.create_task(server.serve([door.listener]))
        for server, door in zip(servers, doors, strict=True)
    ]
    try:
        await _step(node, clock, lambda: should_stop() or any(task.done() for task in serving))
    finally:
        for server in servers:
            server.should_exit = True
        await asyncio.gather(*serving)


async def _step(node: Node, clock: Clock, should_stop: Callable[[], bool]) -> None:
    """Step on absolute deadlines, as `run_node` does; skip periods that were missed."""
    deadline_ns = clock.now_ns()
    while not should_stop():
        node.step()
        if isinstance(clock, TwinClock):
            clock.release()  # requests are answered by the wall clock, and hold nothing
        period_ns = round(node.period_s * NS_PER_S)
        deadline_ns = max(deadline_ns + period_ns, clock.now_ns())
        await asyncio.sleep((deadline_ns - clock.now_ns()) / NS_PER_S)


def _config(app: ASGIApp, door: Door, connections: Connections) -> uvicorn.Config:
    tls = door.tls
    return uvicorn.Config(
        _named(app, door.name),
        log_config=None,
        log_level=logging.WARNING,
        access_log=False,
        lifespan="off",
        loop="asyncio",
        http=bounded_by(connections),
        ws=LiveProtocol,
        ws_per_message_deflate=False,  # it would compress each message anew for each client
        proxy_headers=False,
        server_header=False,
        h11_max_incomplete_event_size=HEAD_BYTES,
        timeout_keep_alive=_KEEP_ALIVE_S,
        timeout_graceful_shutdown=GOODBYE_S,
        ws_max_size=_MOST_MESSAGE_BYTES,
        ssl_context_factory=None if tls is None else lambda *_: tls,
    )


def _named(app: ASGIApp, name: str) -> ASGIApp:
    """Let the application know through which door a request came: `scope["door"]`."""

    async def through_door(scope: Any, receive: Any, send: Any) -> None:
        await app({**scope, "door": name}, receive, send)

    return through_door
