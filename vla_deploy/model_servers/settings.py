"""Declare model servers as a person does in `servers.toml`, and read that file."""

import re
import tomllib
from collections.abc import Iterator, Mapping
from enum import StrEnum
from pathlib import Path
from typing import Annotated, Any, Final, Self
from urllib.parse import SplitResult, urlsplit

from pydantic import BaseModel, ConfigDict, Field, ValidationError, field_validator, model_validator

from vla_deploy.model_servers.errors import ServersFileInvalid
from vla_deploy.runtime.table_schema import parse_toml

SERVERS_FILE: Final = "servers.toml"
_TABLE: Final = "servers"
NAME_PATTERN: Final = r"^[a-z][a-z0-9_-]{0,31}$"
_CREDENTIAL_PATTERN: Final = r"^[a-z][a-z0-9_]{0,63}$"


class Api(StrEnum):
    """Name the languages that servers speak."""

    OPENAI_COMPATIBLE = "openai_compatible"
    OLLAMA = "ollama"
    OPENAI = "openai"
    ANTHROPIC = "anthropic"


class Location(StrEnum):
    """Say where a server runs: on this computer, or anywhere else."""

    LOCAL = "local"
    REMOTE = "remote"


Seconds = Annotated[float, Field(gt=0.0, le=600.0)]


class ServerSettings(BaseModel):
    """Hold what is declared of one server; the defaults suit a model on this computer.

    `total_timeout_s` bounds a call from its beginning to its end, waiting and retries included.
    `vision` says that the model takes images. `temperature` is sent only where it is given: some
    models take none. Without `trust_plans` a person agrees to each plan of it before anything
    moves, however sure it says that it is.
    """

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)

    api: Annotated[Api, Field(strict=False)]
    url: str
    model: Annotated[str, Field(min_length=1, max_length=200)]
    location: Annotated[Location, Field(strict=False)]
    vision: bool = False
    credential: Annotated[str, Field(pattern=_CREDENTIAL_PATTERN)] | None = None
    ca_file: Annotated[Path, Field(strict=False)] | None = None
    allow_text_off_robot: bool = False
    allow_images_off_robot: bool = False
    temperature: Annotated[float, Field(ge=0.0, le=2.0)] | None = None
    trust_plans: bool = False
    max_answer_tokens: Annotated[int, Field(ge=1, le=65_536)] = 2048
    max_answer_bytes: Annotated[int, Field(ge=1024, le=16 * 2**20)] = 2**20
    connect_timeout_s: Seconds = 2.0
    read_timeout_s: Seconds = 30.0
    total_timeout_s: Seconds = 45.0
    max_calls: Annotated[int, Field(ge=1, le=32)] = 1
    max_waiting: Annotated[int, Field(ge=0, le=256)] = 4
    max_calls_per_minute: Annotated[int, Field(ge=1, le=6000)] = 30
    max_attempts: Annotated[int, Field(ge=1, le=10)] = 3
    backoff_s: Annotated[float, Field(gt=0.0, le=60.0)] = 0.5
    backoff_max_s: Annotated[float, Field(gt=0.0, le=600.0)] = 8.0
    breaker_failures: Annotated[int, Field(ge=1, le=100)] = 4
    breaker_open_s: Seconds = 30.0

    @field_validator("url")
    @classmethod
    def _plain_address(cls, url: str) -> str:
        parts = _split(url)
        if parts is None or parts.scheme not in ("http", "https") or not parts.hostname:
            raise ValueError("expected http:// or https:// with a host")
        if parts.username or parts.password or parts.query or parts.fragment:
            raise ValueError("expected no user, password, query or fragment; a key is a credential")
        return url.rstrip("/")

    @model_validator(mode="after")
    def _makes_sense(self) -> Self:
        allowed = self.allow_text_off_robot or self.allow_images_off_robot
        if self.location is Location.LOCAL and allowed:
            raise ValueError(
                "allow_..._off_robot: expected nothing, a local server is on the robot"
            )
        if self.api in (Api.OLLAMA, Api.ANTHROPIC) and self.url.endswith("/v1"):
            raise ValueError(f"url: expected it without /v1 for {self.api}")
        if self.allow_images_off_robot and not self.allow_text_off_robot:
            raise ValueError("allow_images_off_robot: expected allow_text_off_robot too")
        return self

    @property
    def is_local(self) -> bool:
        """Return whether the server is declared to run on this computer."""
        return self.location is Location.LOCAL

    @property
    def host(self) -> str:
        """Return the name or address to connect to."""
        return str(urlsplit(self.url).hostname)


def _split(url: str) -> SplitResult | None:
    try:
        parts = urlsplit(url)
        return parts if parts.port != 0 else None
    except ValueError:  # a port that is no number, brackets that do not close
        return None


def read_servers(file: Path) -> dict[str, ServerSettings]:
    """Return the declared servers by name; none where the file is missing.

    Raises:
        ServersFileInvalid: it is no TOML, or has faults; all of them are listed.
    """
    try:
        document = parse_toml(file.read_text(encoding="utf-8"))
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
