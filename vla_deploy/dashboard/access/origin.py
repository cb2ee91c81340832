"""Judge under which name the robot was reached, and from which page."""

import ipaddress
import re
from collections.abc import Iterable, Mapping, Sequence
from typing import Final

from vla_deploy.dashboard.access.errors import HostRefused, OriginRefused

_HOST: Final = re.compile(r"(?P<name>\[[0-9a-f:.]+\]|[a-z0-9._-]{1,253})(?::(?P<port>\d{1,5}))?")
_DEFAULT_PORT: Final = {"http": "80", "https": "443"}
_CHANGES_NOTHING: Final = frozenset({"GET", "HEAD", "OPTIONS"})
FORWARDED: Final = ("forwarded", "x-forwarded-for", "x-forwarded-host", "x-real-ip", "via")
"""What reverse proxies add: behind one, the address of the connection says nothing."""

Headers = Mapping[str, Sequence[str]]


def host_name(headers: Headers) -> str:
    """Return the name in the Host header, in small letters and without port or brackets.

    Raises:
        HostRefused: there is none, more than one, or none that is a name.
    """
    given = headers.get("host", ())
    parts = _HOST.fullmatch(given[0].lower()) if len(given) == 1 else None
    if parts is None:
        raise HostRefused("expected one Host header with a name", "use the url of the robot")
    return parts["name"].strip("[]").rstrip(".")


def check_host(name: str, own: Iterable[str]) -> None:
    """Accept addresses, names of this computer and those that the settings add.

    A page of another site that has its own name resolve to this robot arrives under that name.

    Raises:
        HostRefused: it is none of them.
    """
    if _address(name) is None and not is_loopback_name(name) and name not in own:
        raise HostRefused(
            f"reached as {name!r:.80}, which is no name of this robot",
            "use its address, or add the name to allowed_hosts in dashboard.toml",
        )


def is_loopback_name(name: str) -> bool:
    """Tell whether a name always means this computer."""
    address = _address(name)
    return name == "localhost" if address is None else address.is_loopback


def check_origin(method: str, scheme: str, headers: Headers, allowed: Iterable[str]) -> None:
    """Accept what own pages ask, and what no page asks: programs send no Origin.

    `method` is that of HTTP, or WEBSOCKET. Browsers tell the origin of every change and of every
    WebSocket; of what only reads, newer ones tell the site.

    Raises:
        OriginRefused: another site's page asks.
    """
    origins = headers.get("origin", ())
    if method not in _CHANGES_NOTHING and origins:
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
    """Return an origin in small letters and without the port that its scheme implies."""
    origin = origin.lower()
    scheme, _, host = origin.partition("://")
    return f"{scheme}://{host.removesuffix(':' + _DEFAULT_PORT.get(scheme, ''))}"


def _address(name: str) -> ipaddress.IPv4Address | ipaddress.IPv6Address | None:
    try:
        return ipaddress.ip_address(name)
    except ValueError:
        return None


def _refuse(origin: str) -> None:
    raise OriginRefused(
        f"asked by a page {origin!r:.80}, expected one of this robot",
        "open the robot's own page; a proxy's belongs into allowed_origins in dashboard.toml",
    )
