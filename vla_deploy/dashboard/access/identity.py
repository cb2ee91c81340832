"""Describe the user of a request: connection, authentication method and role."""

import ipaddress
from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum
from typing import Any, Final

from vla_deploy.client.access.accounts import UserRole

IDENTITY: Final = "identity"
"""The key of a request's state that holds its identity."""
UNKNOWN: Final = "unknown"
SOCKET: Final = "socket"
_V6_NETWORK_BITS: Final = 64  # one subscriber has a network of that size


class AuthMethod(StrEnum):
    """Name how a user was authenticated."""

    NONE = "none"
    LOOPBACK = "loopback"
    SOCKET = "socket"
    SESSION = "session"
    TOKEN = "token"


@dataclass(frozen=True, slots=True, kw_only=True)
class Identity:
    """Describe the user of a request.

    `user` is the name of an account, of a token, or of the method; `address` is the other end of
    the connection. `csrf` is what a session's changes must repeat, empty for other methods.
    """

    role: UserRole
    user: str
    way: AuthMethod
    address: str
    csrf: str = ""


def unknown_user(address: str) -> Identity:
    """Return the identity of a user who is not authenticated."""
    return Identity(role=UserRole.ANYONE, user="anyone", way=AuthMethod.NONE, address=address)


@dataclass(frozen=True, slots=True, kw_only=True)
class Peer:
    """Describe the other end of a connection.

    `is_socket`: it came by the Unix socket, whose file only owner and group may open.
    """

    address: str
    is_loopback: bool
    is_socket: bool = False

    @property
    def rate_key(self) -> str:
        """Return what limits count by: the address of IPv4, the /64 network of IPv6."""
        try:
            address = ipaddress.ip_address(self.address)
        except ValueError:
            return self.address
        if address.version == 4:
            return self.address
        return str(ipaddress.ip_network((address, _V6_NETWORK_BITS), strict=False))


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
    """Return the peer at an address; an IPv4-mapped IPv6 address counts as IPv4."""
    try:
        address = ipaddress.ip_address(text.partition("%")[0])
    except ValueError:
        return Peer(address=UNKNOWN, is_loopback=False)
    mapped = getattr(address, "ipv4_mapped", None)
    plain = address if mapped is None else mapped
    return Peer(address=str(plain), is_loopback=plain.is_loopback)
