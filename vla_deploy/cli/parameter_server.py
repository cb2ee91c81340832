"""Choose by the parameters of ROS the model server that the planner asks besides."""

import json
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final
from urllib.parse import urlsplit

from vla_deploy.gateways.ros.parameters import PARAMETERS
from vla_deploy.model_servers.settings import Api, Location, ServerSettings

_DEFAULTS: Final = {one.name: one.default for one in PARAMETERS}
_APIS: Final = {"anthropic": Api.ANTHROPIC, "openai": Api.OPENAI}
_URLS: Final = {"anthropic": "https://api.anthropic.com", "openai": "https://api.openai.com/v1"}
_HERE: Final = frozenset({"localhost", "127.0.0.1", "::1"})
_OLLAMA_PORT: Final = 11434
Values = Mapping[str, Any]


@dataclass(frozen=True, slots=True, kw_only=True)
class ServerChoice:
    """Name the chosen server, "" for none; `fault` tells what must be declared first."""

    name: str = ""
    fault: str = ""
    notes: tuple[str, ...] = ()


def chosen_server(
    given: Values, declared: Mapping[str, ServerSettings], file: Path
) -> ServerChoice:
    """Return the server of `servers.toml`, which is `file`, that the parameters name.

    The name of the local model at its default names none: every parameter file has it.
    """
    provider = given.get("vlm_provider", _DEFAULTS["vlm_provider"])
    name = "vlm_model" if provider in _APIS else "local_vlm_model"
    other = "local_vlm_model" if provider in _APIS else "vlm_model"
    model = str(given.get(name, ""))
    notes: tuple[str, ...] = ()
    if given.get(other, _DEFAULTS[other]) != _DEFAULTS[other]:
        notes = (f"{other}: {given[other]} is not asked: vlm_provider is {provider}",)
    if not model:
        return ServerChoice(notes=notes)
    for server, settings in declared.items():
        if settings.model == model and _is_of(provider, settings, given):
            return ServerChoice(name=server, notes=notes)
    if model == _DEFAULTS[name] and _url(given) == _DEFAULTS["local_vlm_url"]:
        return ServerChoice(notes=notes)
    lines = "\n".join(f"  {line}" for line in server_lines(given, provider, model, declared))
    fault = (
        f"{name}: expected a server that {file} declares with model {model!r}, got none; "
        f"add, and change as needed (docs/model-servers.md):\n{lines}"
    )
    return ServerChoice(fault=fault, notes=notes)


def server_lines(
    given: Values, provider: str, model: str, taken: Iterable[str] = ()
) -> tuple[str, ...]:
    """Return the lines of `servers.toml` that declare what the parameters name."""
    names = (provider, *(f"{provider}_{number}" for number in range(2, 100)))
    name = next(one for one in names if one not in set(taken))
    head = (f"[servers.{name}]", f"model = {json.dumps(model, ensure_ascii=False)}")
    if provider in _APIS:
        return (
            *head,
            f'api = "{_APIS[provider].value}"',
            f'url = "{_URLS[provider]}"',
            f'location = "{Location.REMOTE.value}"',
            f'credential = "{provider}_api_key"',
            "allow_text_off_robot = true  # commands, names of things, where they are",
        )
    url = _url(given).rstrip("/")
    api = Api.OLLAMA if _address(url)[1] == _OLLAMA_PORT else Api.OPENAI_COMPATIBLE
    if api is Api.OPENAI_COMPATIBLE and not url.endswith("/v1"):
        url += "/v1"
    location = f'location = "{Location.LOCAL.value}"'
    return (*head, f'api = "{api.value}"', f"url = {json.dumps(url)}", location)


def _is_of(provider: str, settings: ServerSettings, given: Values) -> bool:
    if provider in _APIS:
        return settings.api is _APIS[provider]
    if settings.location is not Location.LOCAL:
        return False
    url = _url(given)
    return url == _DEFAULTS["local_vlm_url"] or _address(url) == _address(settings.url)


def _url(given: Values) -> str:
    return str(given.get("local_vlm_url", _DEFAULTS["local_vlm_url"]))


def _address(url: str) -> tuple[str, int | None]:
    try:
        parts = urlsplit(url)
        host, port = parts.hostname or "", parts.port
    except ValueError:
        return url, None
    return "localhost" if host in _HERE else host, port or {"http": 80, "https": 443}.get(
        parts.scheme
    )
