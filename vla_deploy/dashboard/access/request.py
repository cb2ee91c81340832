"""Read method, path, Host and Origin from an ASGI scope, and check Host and Origin."""

import ipaddress
import re
from collections.abc import Iterable, Mapping, MutableMapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

from vla_deploy.dashboard.access.identity import Peer, peer_of
from vla_deploy.dashboard.errors import AccessDenied, Denial

WEBSOCKET: Final = "WEBSOCKET"
API_PREFIX: Final = "/api/v1"
STOP_PATH: Final = f"{API_PREFIX}/stop"
LOGIN_PATHS: Final = frozenset({f"{API_PREFIX}/login", f"{API_PREFIX}/login/code"})
_READS: Final = frozenset({"GET", "HEAD", "OPTIONS"})
_SECURE: Final = {"ws": "http", "wss": "https"}

Scope = MutableMapping[str, Any]
Headers = Mapping[str, Sequence[str]]
_HOST: Final = re.compile(r"(?P<name>\[[0-9a-f:.]+\]|[a-z0-9._-]{1,253})(?::(?P<port>\d{1,5}))?")
_DEFAULT_PORT: Final = {"http": "80", "https": "443"}
FORWARDED: Final = ("forwarded", "x-forwarded-for", "x-forwarded-host", "x-real-ip", "via")
"""Reverse proxies add these: behind one, the connection's address is not the user's."""


@dataclass(frozen=True, slots=True, kw_only=True)
class IncomingRequest:
    """Describe a request or the opening of a WebSocket.

    `method` is that of HTTP, or WEBSOCKET; `headers` has all values by lower-case name.
    """

    method: str
    path: str
    scheme: str
    headers: Headers
    peer: Peer

    @property
    def is_change(self) -> bool:
        """Return whether it may change something."""
        return self.method not in _READS and self.method != WEBSOCKET

    @property
    def is_stop(self) -> bool:
        """Return whether it presses the stop, which is never refused."""
        return self.method == "POST" and self.path == STOP_PATH

    @property
    def is_login(self) -> bool:
        """Return whether it is a login, which needs no CSRF token."""
        return self.method == "POST" and self.path in LOGIN_PATHS

    def first(self, name: str) -> str:
        """Return the first value of a header, "" when there is none."""
        values = self.headers.get(name, ())
        return values[0] if values else ""


def read_request(scope: Scope) -> IncomingRequest:
    """Return the request of an ASGI scope."""
    headers: dict[str, list[str]] = {}
    for name, value in scope["headers"]:
        headers.setdefault(name.decode("latin-1").lower(), []).append(value.decode("latin-1"))
    scheme = str(scope.get("scheme", "http"))
    return IncomingRequest(
        method=WEBSOCKET if scope["type"] == "websocket" else str(scope["method"]),
        path=str(scope["path"]),
        scheme=_SECURE.get(scheme, scheme),
        headers=headers,
        peer=peer_of(scope),
    )


def host_name(headers: Headers) -> str:
    """Return the name in the Host header, in lower case and without port or brackets.

    Raises:
        AccessDenied: there is not exactly one Host header, or it holds no name.
    """
    given = headers.get("host", ())
    parts = _HOST.fullmatch(given[0].lower()) if len(given) == 1 else None
    if parts is None:
        raise AccessDenied(
            Denial.HOST_REFUSED, "expected one Host header with a name", "use the url of the robot"
        )
    return parts["name"].strip("[]").rstrip(".")


def check_host(name: str, own: Iterable[str]) -> None:
    """Accept addresses, names of this computer and those that the settings add.

    This refuses DNS rebinding: another site's name that resolves to this robot.

    Raises:
        AccessDenied: it is none of them.
    """
    if _address(name) is None and not is_loopback_name(name) and name not in own:
        raise AccessDenied(
            Denial.HOST_REFUSED,
            f"reached as {name!r:.80}, which is no name of this robot",
            "use its address, or add the name to allowed_hosts in dashboard.toml",
        )


def is_loopback_name(name: str) -> bool:
    """Return whether a name always means this computer."""
    address = _address(name)
    return name == "localhost" if address is None else address.is_loopback


def check_origin(method: str, scheme: str, headers: Headers, allowed: Iterable[str]) -> None:
    """Accept requests of the robot's own pages, and of programs, which send no Origin.

    `method` is that of HTTP, or WEBSOCKET. Browsers send the Origin with every change and every
    WebSocket; with requests that only read, newer ones send Sec-Fetch-Site.

    Raises:
        AccessDenied: the request comes from another site's page.
    """
    origins = headers.get("origin", ())
    if method not in _READS and origins:
        own = {_plain(f"{scheme}://{host}") for host in headers.get("host", ())} | set(
            map(_plain, allowed)
        )
        if len(origins) > 1 or _plain(origins[0]) not in own:
            _refuse(origins[0])
        return
    sites = set(headers.get("sec-fetch-site", ()))
    opens_page = method == "GET" and "navigate" in headers.get("sec-fetch-mode", ())
    if sites & {"cross-site", "same-site"} and not opens_page:
        _refuse("of another site")


def _plain(origin: str) -> str:
    """Return an origin in lower case and without its scheme's default port."""
    origin = origin.lower()
    scheme, _, host = origin.partition("://")
    return f"{scheme}://{host.removesuffix(':' + _DEFAULT_PORT.get(scheme, ''))}"


def _address(name: str) -> ipaddress.IPv4Address | ipaddress.IPv6Address | None:
    try:
        return ipaddress.ip_address(name)
    except ValueError:
        return None


def _refuse(origin: str) -> None:
    raise AccessDenied(
        Denial.ORIGIN_REFUSED,
        f"asked by a page {origin!r:.80}, expected one of this robot",
        "open the robot's own page; a proxy's belongs into allowed_origins in dashboard.toml",
    )
