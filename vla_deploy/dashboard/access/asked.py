"""Read from an ASGI scope what access is judged by."""

from collections.abc import Mapping, MutableMapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

from vla_deploy.dashboard.access.peer import Peer, peer_of

WEBSOCKET: Final = "WEBSOCKET"
API_PREFIX: Final = "/api/v1"
STOP_PATH: Final = f"{API_PREFIX}/stop"
LOGIN_PATH: Final = f"{API_PREFIX}/login"
_READS: Final = frozenset({"GET", "HEAD", "OPTIONS"})
_SECURE: Final = {"ws": "http", "wss": "https"}

Scope = MutableMapping[str, Any]


@dataclass(frozen=True, slots=True, kw_only=True)
class Asked:
    """Describe a request or the opening of a WebSocket.

    `method` is that of HTTP, or WEBSOCKET; `headers` hold every value by its name in small letters.
    """

    method: str
    path: str
    scheme: str
    headers: Mapping[str, Sequence[str]]
    peer: Peer

    @property
    def is_change(self) -> bool:
        """Tell whether it may change something."""
        return self.method not in _READS and self.method != WEBSOCKET

    @property
    def is_stop(self) -> bool:
        """Tell whether it presses the stop, which nothing may refuse."""
        return self.method == "POST" and self.path == STOP_PATH

    @property
    def is_login(self) -> bool:
        """Tell whether it asks for a session, whatever session there is."""
        return self.method == "POST" and self.path == LOGIN_PATH

    def first(self, name: str) -> str:
        """Return the first value of a header, "" when there is none."""
        values = self.headers.get(name, ())
        return values[0] if values else ""


def asked_of(scope: Scope) -> Asked:
    """Return what a connection asks for."""
    headers: dict[str, list[str]] = {}
    for name, value in scope["headers"]:
        headers.setdefault(name.decode("latin-1").lower(), []).append(value.decode("latin-1"))
    scheme = str(scope.get("scheme", "http"))
    return Asked(
        method=WEBSOCKET if scope["type"] == "websocket" else str(scope["method"]),
        path=str(scope["path"]),
        scheme=_SECURE.get(scheme, scheme),
        headers=headers,
        peer=peer_of(scope),
    )
