"""Read where the robot's HTTP servers listen, open their ports, load their certificate.

It imports the standard library alone, for the stop door.
"""

import errno
import re
import socket
import ssl
import tomllib
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final, NoReturn

from vla_deploy.runtime.state_dir import config_dir_of
from vla_deploy.runtime.table_schema import parse_toml

SETTINGS_FILE: Final = "dashboard.toml"
DASHBOARD_SOCKET: Final = "dashboard.sock"
"""In the run's directory, by which programs of the robot's user ask without a token."""
_LAST_PORT: Final = 65535
_BEYOND_GROUP_READ: Final = 0o037
_ORIGIN: Final = re.compile(r"https?://[A-Za-z0-9.\[\]:_-]+")
BACKLOG: Final = 1024
"""A client that finds no place in it tries again after a second: no press may."""
_PAIRS: Final = 200


class NetError(Exception):
    """Base of the errors that keep a server from listening; a person can mend them."""


class DashboardSettingsInvalid(NetError):
    """Report every fault of `dashboard.toml`."""

    def __init__(self, faults: tuple[str, ...]) -> None:
        super().__init__("\n".join(faults))
        self.faults = faults


class PortTaken(NetError):
    """Report that the configured address cannot be listened at."""


class TlsUnusable(NetError):
    """Report what is wrong with certificate or key, and what to try."""


@dataclass(frozen=True, slots=True, kw_only=True)
class DashboardSettings:
    """Configure where the dashboard and the stop door listen, and whom they trust.

    With `trust_loopback` every request from loopback is an admin's: of any user of this computer,
    of any container on its network, and of a reverse proxy there. `allowed_hosts` are further names
    of the robot, besides loopback and `host`; all others are refused as DNS rebinding.
    `allowed_origins` are those of pages that a proxy serves for the robot, such as
    `https://robot.example`.
    """

    host: str = "127.0.0.1"
    port: int = 8088
    stop_port: int = 8089
    allowed_hosts: tuple[str, ...] = ()
    allowed_origins: tuple[str, ...] = ()
    trust_loopback: bool = False
    tls_certificate: str = ""
    tls_key: str = ""

    @property
    def scheme(self) -> str:
        """Return the scheme of both servers' addresses."""
        return "https" if self.tls_certificate else "http"


@dataclass(frozen=True, slots=True)
class _Rule:
    """Describe a key: the accepted values in words, the check, and the conversion."""

    words: str
    allows: Callable[[Any], bool]
    take: Callable[[Any], Any] = lambda value: value


def _is_port(value: object) -> bool:
    return type(value) is int and 1 <= value <= _LAST_PORT


def _is_text(value: object) -> bool:
    return isinstance(value, str) and bool(value.strip())


def _is_names(value: object) -> bool:
    return isinstance(value, list) and all(map(_is_text, value))


def _is_origins(value: object) -> bool:
    return isinstance(value, list) and all(
        isinstance(one, str) and _ORIGIN.fullmatch(one) is not None for one in value
    )


_PORT = _Rule(f"a port, 1 to {_LAST_PORT}", _is_port)
_FILE = _Rule("the path of a PEM file", _is_text)
_RULES: Final[Mapping[str, _Rule]] = {
    "host": _Rule("an address or a name to listen at, such as 0.0.0.0", _is_text),
    "port": _PORT,
    "stop_port": _PORT,
    "allowed_hosts": _Rule("a list of host names", _is_names, tuple),
    "allowed_origins": _Rule("a list such as https://robot.example", _is_origins, tuple),
    "trust_loopback": _Rule("true or false", lambda value: isinstance(value, bool)),
    "tls_certificate": _FILE,
    "tls_key": _FILE,
}


def read_settings(base: Path) -> DashboardSettings:
    """Return the settings for the runs of a runtime directory, the defaults without a file.

    Raises:
        DashboardSettingsInvalid: the file is no TOML, or has faults; all of them are listed.
    """
    file = config_dir_of(base) / SETTINGS_FILE
    try:
        document = parse_toml(file.read_text(encoding="utf-8"))
    except FileNotFoundError:
        return DashboardSettings()
    except (OSError, tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise DashboardSettingsInvalid((f"{file}: expected a TOML document: {error}",)) from error
    faults = tuple(f"{file}: {fault}" for fault in faults_of(document))
    if faults:
        raise DashboardSettingsInvalid(faults)
    return DashboardSettings(**{key: _RULES[key].take(value) for key, value in document.items()})


def faults_of(document: Mapping[str, Any]) -> list[str]:
    """Return every fault of a settings document."""
    return [*_wrong_keys(document)] or [*_contradictions(document)]


def _wrong_keys(document: Mapping[str, Any]) -> Iterator[str]:
    for key, value in document.items():
        if key not in _RULES:
            yield f"{key}: unknown, expected one of {', '.join(_RULES)}"
        elif not _RULES[key].allows(value):
            yield f"{key}: expected {_RULES[key].words}, got {value!r:.60}"


def _contradictions(document: Mapping[str, Any]) -> Iterator[str]:
    port, stop_port = (
        document.get(key, getattr(DashboardSettings(), key)) for key in ("port", "stop_port")
    )
    if port == stop_port:
        yield f"stop_port: expected another port than the dashboard's, got {stop_port} for both"
    if ("tls_certificate" in document) != ("tls_key" in document):
        yield "tls_certificate, tls_key: expected both or neither"


def open_port(host: str, port: int, *, search: bool, before: int | None = None) -> socket.socket:
    """Listen at a TCP port; with `search`, at the next free one in steps of two.

    `before` is the port of an earlier instance, at which open pages look for this one; it is tried
    first.

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


def _searched(port: int) -> Iterator[int]:
    return (one for one in range(port, port + 2 * _PAIRS, 2) if one < 2**16)


def _listen(host: str, port: int) -> socket.socket:
    family, kind, _, _, address = socket.getaddrinfo(
        host, port, type=socket.SOCK_STREAM, flags=socket.AI_PASSIVE
    )[0]
    listening = socket.socket(family, kind)
    try:
        listening.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        listening.bind(address)
        listening.listen(BACKLOG)
    except OSError:
        listening.close()
        raise
    return listening


def server_context(certificate: str, key: str) -> ssl.SSLContext:
    """Return the TLS context of a server, for TLS 1.2 and later.

    Raises:
        TlsUnusable: a file is missing, may not be read, is no PEM, needs a password or does not
            belong to the other; or others may read the key.
    """
    for setting, path in (("tls_certificate", certificate), ("tls_key", key)):
        try:
            with Path(path).open("rb"):
                pass
        except OSError as error:
            raise TlsUnusable(
                f"{setting} {path}: {error.strerror}; the robot's user has to be able to read it, "
                "below /etc/vla-deploy for the service"
            ) from error
    if Path(key).stat().st_mode & _BEYOND_GROUP_READ:
        raise TlsUnusable(f"tls_key {key}: others may read it, expected: chmod 640 {key}, or 600")
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
    context.minimum_version = ssl.TLSVersion.TLSv1_2
    try:
        context.load_cert_chain(certificate, key, password=lambda: _refuse_password(key))
    except ssl.SSLError as error:
        raise TlsUnusable(
            f"tls_certificate {certificate}, tls_key {key}: {error.reason or error}; expected PEM "
            "files that belong together, the robot's own certificate first"
        ) from error
    return context


def _refuse_password(key: str) -> NoReturn:
    """Refuse instead of asking for it: the robot starts unattended."""
    raise TlsUnusable(
        f"tls_key {key}: it needs a password, expected a key without: openssl pkey -in {key}"
    )
