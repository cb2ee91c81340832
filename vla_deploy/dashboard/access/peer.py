"""Tell from which computer a connection comes."""

import ipaddress
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final

UNKNOWN: Final = "unknown"
SOCKET: Final = "socket"
_V6_HOME_BITS: Final = 64  # one subscriber has that many addresses: they count as one


@dataclass(frozen=True, slots=True, kw_only=True)
class Peer:
    """Describe the other end of a connection.

    `is_socket` says that it came by the Unix socket, whose file only this user may open.
    """

    address: str
    is_loopback: bool
    is_socket: bool = False

    @property
    def home(self) -> str:
        """Return what is counted as one: an address of IPv4, a network of 64 bits of IPv6."""
        try:
            address = ipaddress.ip_address(self.address)
        except ValueError:
            return self.address
        if address.version == 4:
            return self.address
        return str(ipaddress.ip_network((address, _V6_HOME_BITS), strict=False))


def peer_of(scope: Mapping[str, Any]) -> Peer:
    """Return the other end of an ASGI connection.

    A connection that broke at once has no client either: only its own end, a path without a port,
    proves that it came by the Unix socket.
    """
    server, client = scope.get("server"), scope.get("client")
    if server is not None and server[1] is None:
        return Peer(address=SOCKET, is_loopback=False, is_socket=True)
    if client is None:
        return Peer(address=UNKNOWN, is_loopback=False)
    return peer_at(str(client[0]))


def peer_at(text: str) -> Peer:
    """Return the peer at an address; one of IPv4 in IPv6's clothes as what it is."""
    try:
        address = ipaddress.ip_address(text.partition("%")[0])
    except ValueError:
        return Peer(address=UNKNOWN, is_loopback=False)
    mapped = getattr(address, "ipv4_mapped", None)
    plain = address if mapped is None else mapped
    return Peer(address=str(plain), is_loopback=plain.is_loopback)
