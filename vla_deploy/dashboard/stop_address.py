"""Say where the stop door is for whoever reached the dashboard."""

import re
from typing import Final

from starlette.requests import HTTPConnection

STATUS_TOPIC: Final = "stop_door_status"
_HOST: Final = re.compile(r"(\[[0-9a-fA-F:.]+\]|[A-Za-z0-9._-]+)(:\d{1,5})?")


def stop_door_url(request: HTTPConnection) -> str:
    """Return the stop door's address by the host name that the request used.

    The door itself tells its port, also once it is gone; until it has, the settings do.
    """
    state = request.app.state
    told = state.link.document(STATUS_TOPIC) or {}
    port = told.get("port", state.settings.stop_port)
    return f"{state.settings.scheme}://{called_host(request) or state.settings.host}:{port}"


def called_host(request: HTTPConnection) -> str:
    """Return the host by whose name the request came, without the port; "" when it is malformed."""
    found = _HOST.fullmatch(request.headers.get("host", ""))
    return found[1] if found else ""
