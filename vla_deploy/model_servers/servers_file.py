"""Read `servers.toml`, where a person declares which model servers the robot may ask."""

import re
import tomllib
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, Final

from pydantic import ValidationError

from vla_deploy.model_servers.errors import ServersFileInvalid
from vla_deploy.model_servers.settings import NAME_PATTERN, ServerSettings

SERVERS_FILE: Final = "servers.toml"
_TABLE: Final = "servers"


def read_servers(file: Path) -> dict[str, ServerSettings]:
    """Return the declared servers by name; none where the file is missing.

    Raises:
        ServersFileInvalid: it is no TOML, or has faults; all of them are listed.
    """
    try:
        document = tomllib.loads(file.read_text(encoding="utf-8"))
    except FileNotFoundError:
        return {}
    except (OSError, tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise ServersFileInvalid((f"{file}: expected a TOML document: {error}",)) from error
    servers: dict[str, ServerSettings] = {}
    faults = [f"{file}: {key}: unknown, expected {_TABLE}" for key in document if key != _TABLE]
    tables = document.get(_TABLE, {})
    if not isinstance(tables, Mapping):
        faults.append(f"{file}: {_TABLE}: expected tables [{_TABLE}.NAME], got {tables!r:.60}")
        tables = {}
    for name, table in tables.items():
        where = f"{file}: {_TABLE}.{name}"
        try:
            servers[name] = ServerSettings.model_validate(table)
        except ValidationError as error:
            faults += _faults(where, error)
        if not re.fullmatch(NAME_PATTERN, name):
            faults.append(f"{where}: expected a name of small letters, digits, _ and -")
    if faults:
        raise ServersFileInvalid(tuple(faults))
    return servers


def _faults(where: str, error: ValidationError) -> Iterator[str]:
    """Say each fault; what was given is shown unless it may hold a key."""
    for fault in error.errors(include_url=False):
        place = ".".join([where, *map(str, fault["loc"])])
        text = fault["msg"].removeprefix("Value error, ")
        yield f"{place}: {text}{_given(fault)}"


def _given(fault: Any) -> str:
    given = fault["input"]
    may_hold_a_key = fault["loc"] and fault["loc"][0] in ("url", "credential")
    if fault["type"] in ("missing", "extra_forbidden") or may_hold_a_key:
        return ""
    return "" if isinstance(given, Mapping) else f", got {given!r:.60}"
