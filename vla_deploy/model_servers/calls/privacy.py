"""Decide what may leave the robot, and to which address: nothing unless it is configured."""

import ipaddress
import socket
import threading
from collections.abc import Callable, Sequence
from typing import Final

from vla_deploy.model_servers.chat import Chat
from vla_deploy.model_servers.errors import PrivacyRefused, ServerUnreachable, TimedOut
from vla_deploy.model_servers.settings import ServerSettings

Address = ipaddress.IPv4Address | ipaddress.IPv6Address
Resolve = Callable[[str, int, float], Sequence[str]]
_HTTPS: Final = "https://"


def check_privacy(name: str, settings: ServerSettings, chat: Chat) -> None:
    """Accept what a chat would send to a server.

    Raises:
        PrivacyRefused: the server is not on the robot, and that was not allowed.
    """
    if settings.is_local:
        return
    if not settings.allow_text_off_robot:
        raise PrivacyRefused(_said(name, "text", "allow_text_off_robot"))
    if chat.has_images and not settings.allow_images_off_robot:
        raise PrivacyRefused(_said(name, "images", "allow_images_off_robot"))


def _said(name: str, what: str, key: str) -> str:
    return (
        f"server {name} is not on the robot, and {what} may not leave it; nothing was sent. "
        f"To allow it: servers.{name}.{key} = true"
    )


def resolve(host: str, port: int, timeout_s: float) -> tuple[str, ...]:
    """Return every address of a host; the system's resolver knows no time-out of its own.

    Raises:
        TimedOut: the resolver does not answer in time; its thread is left behind.
        ServerUnreachable: there is no such host.
    """
    if _is_literal(host):
        return (host,)
    found: list[tuple[str, ...] | OSError] = []
    thread = threading.Thread(target=_ask, args=(host, port, found), name="resolve", daemon=True)
    thread.start()
    thread.join(timeout_s)
    if not found:
        raise TimedOut(f"{host}: no address within {timeout_s:g} s; look at the name server")
    if isinstance(found[0], OSError):
        reason = found[0].strerror or found[0]
        raise ServerUnreachable(f"{host}: no address: {reason}", was_sent=False) from found[0]
    return found[0]


def check_address(settings: ServerSettings, text: str) -> None:
    """Accept an address that a server of these settings may have.

    Raises:
        PrivacyRefused: a local server is elsewhere, or the way to a public one is not encrypted.
    """
    address = _plain(text)
    if settings.is_local and not address.is_loopback:
        raise PrivacyRefused(
            f'{settings.host} is at {address}, not on this computer, but location is "local"; '
            'nothing was sent. If text shall leave the robot: location = "remote" and '
            "allow_text_off_robot = true"
        )
    encrypted = settings.url.startswith(_HTTPS)
    if not (encrypted or address.is_loopback or address.is_private):
        raise PrivacyRefused(
            f"{settings.host} is at the public address {address}; expected https://, nothing was "
            "sent in the clear"
        )


def _ask(host: str, port: int, found: list[tuple[str, ...] | OSError]) -> None:
    try:
        rows = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM)
        found.append(tuple(dict.fromkeys(str(row[4][0]) for row in rows)))
    except OSError as error:
        found.append(error)
    except UnicodeError as error:  # a label that is too long for a name server
        found.append(OSError(str(error)))


def _is_literal(host: str) -> bool:
    try:
        ipaddress.ip_address(host)
    except ValueError:
        return False
    return True


def _plain(text: str) -> Address:
    """Return an address without its zone; one of IPv4 in IPv6's clothes as what it is."""
    address = ipaddress.ip_address(text.partition("%")[0])
    mapped = getattr(address, "ipv4_mapped", None)
    return mapped if mapped is not None else address
