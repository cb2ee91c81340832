"""x"""

import socket
from pathlib import Path
from typing import Final

from vla_deploy.ipc.doorbell import short_path
from vla_deploy.runtime.net import BACKLOG, PortTaken

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
