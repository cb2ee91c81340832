"""Ask the dashboard, by its Unix socket, for a link by which the robot's user logs a browser in."""

import json
import socket
from http.client import HTTPConnection, HTTPException
from pathlib import Path
from typing import Final

from vla_deploy.client.access.errors import LoginLinkUnavailable
from vla_deploy.ipc.memory.doorbell import short_path
from vla_deploy.runtime.net import DASHBOARD_SOCKET

PATH: Final = "/api/v1/login/link"
_TIMEOUT_S: Final = 3.0


def login_url(run_dir: Path, page_url: str) -> str:
    """Return the page's address with a code that logs one browser in once, within ten minutes.

    Raises:
        LoginLinkUnavailable: the dashboard does not answer, or serves another user.
    """
    connection = HTTPConnection("robot", timeout=_TIMEOUT_S)
    try:
        connection.sock = _connected(run_dir / DASHBOARD_SOCKET)
        connection.request("POST", PATH)
        answer = connection.getresponse()
        told = json.loads(answer.read())
        if answer.status >= 400:
            error = told["error"]
            raise LoginLinkUnavailable(f"{error['what']}; {error['try']}")
        return f"{page_url}/#/login/{told['code']}"
    except (OSError, HTTPException, ValueError, KeyError) as error:
        raise LoginLinkUnavailable(
            f"no link for a login from {run_dir / DASHBOARD_SOCKET}: {error!r}; run as the robot's "
            "user or as root; see: vla-deploy logs dashboard"
        ) from error
    finally:
        connection.close()


def _connected(path: Path) -> socket.socket:
    connection = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
    connection.settimeout(_TIMEOUT_S)
    try:
        with short_path(path.parent) as folder:
            connection.connect(f"{folder}/{path.name}")
    except OSError:
        connection.close()
        raise
    return connection
