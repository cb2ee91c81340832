"""Read `dashboard.toml`, where a person says where the dashboard listens and whom it trusts.

It is read with the standard library alone: the stop door reads it, too.
"""

import re
import tomllib
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from vla_deploy.dashboard.errors import SettingsInvalid
from vla_deploy.runtime.state_dir import config_dir_of

SETTINGS_FILE: Final = "dashboard.toml"
_LAST_PORT: Final = 65535
_ORIGIN: Final = re.compile(r"https?://[A-Za-z0-9.\[\]:_-]+")


@dataclass(frozen=True, slots=True, kw_only=True)
class DashboardSettings:
    """Say where the dashboard and the stop door listen, and whom they trust.

    On loopback a request counts as the admin's unless `trust_loopback` is off: switch it off behind
    a reverse proxy, whose every request comes from there. `allowed_hosts` are names, beside the
    loopback ones and `host`, by which the page may be called: others are taken for DNS rebinding.
    `allowed_origins` are those of pages that a proxy serves for the robot: `https://robot.example`.
    """

    host: str = "127.0.0.1"
    port: int = 8088
    stop_port: int = 8089
    allowed_hosts: tuple[str, ...] = ()
    allowed_origins: tuple[str, ...] = ()
    trust_loopback: bool = True
    tls_certificate: str = ""
    tls_key: str = ""

    @property
    def scheme(self) -> str:
        """Return how both doors are spoken to."""
        return "https" if self.tls_certificate else "http"


@dataclass(frozen=True, slots=True)
class _Rule:
    """Say in words what a key may be, whether a TOML value is, and what it becomes."""

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
    """Return the settings for the runs of a runtime directory; the defaults where there is no file.

    Raises:
        SettingsInvalid: the file is no TOML, or has faults; all of them are listed.
    """
    file = config_dir_of(base) / SETTINGS_FILE
    try:
        document = tomllib.loads(file.read_text(encoding="utf-8"))
    except FileNotFoundError:
        return DashboardSettings()
    except (OSError, tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise SettingsInvalid((f"{file}: expected a TOML document: {error}",)) from error
    faults = tuple(f"{file}: {fault}" for fault in faults_of(document))
    if faults:
        raise SettingsInvalid(faults)
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
