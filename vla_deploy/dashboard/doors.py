"""Open the sockets that the dashboard listens at."""

import errno
import socket
from collections.abc import Iterator
from pathlib import Path
from typing import Final

from vla_deploy.dashboard.errors import PortTaken
from vla_deploy.ipc.memory.doorbell import short_path

SOCKET_NAME: Final = "dashboard.sock"
_BACKLOG: Final = 128
_PAIRS: Final = 200
_SOCKET_MODE: Final = 0o660


def open_port(host: str, port: int, *, search: bool, before: int | None = None) -> socket.socket:
    """Listen at a TCP port; where it is taken, `search` on, two by two.

    `before` is the port that an earlier instance had: pages that are open look for it there.

    Raises:
        PortTaken: another program listens there, or the address is not this computer's.
    """
    first = [before] if search and before else []
    ports = [*first, *_searched(port)] if search else [port]
    for one in ports:
        try:
            return _listen(host, one)
        except OSError as error:
            if error.errno != errno.EADDRINUSE:
                raise PortTaken(
                    f"{host}:{one}: cannot listen there: {error.strerror}; set `host` and `port` "
                    "in dashboard.toml"
                ) from error
    raise PortTaken(
        f"{host}:{port}: another program listens there; find it with `ss -ltnp`, or set another "
        "port in dashboard.toml"
    )


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
    door.listen(_BACKLOG)
    return door


def _searched(port: int) -> Iterator[int]:
    return (one for one in range(port, port + 2 * _PAIRS, 2) if one < 2**16)


def _listen(host: str, port: int) -> socket.socket:
    family, kind, _, _, address = socket.getaddrinfo(
        host, port, type=socket.SOCK_STREAM, flags=socket.AI_PASSIVE
    )[0]
    door = socket.socket(family, kind)
    try:
        door.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        door.bind(address)
        door.listen(_BACKLOG)
    except OSError:
        door.close()
        raise
    return door
