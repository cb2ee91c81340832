"""Run the whole robot by a file of ROS parameters: derive a robot folder and a profile from it.

The parameters may also name the model server that the planner asks.
"""

import json
import logging
import os
import shutil
from collections.abc import Iterable, Mapping, MutableMapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Final
from urllib.parse import urlsplit

import yaml

from platforms import load_profile
from platforms.profile_source import merged, read_source
from platforms.toml_text import toml_lines
from vla_deploy.client.access.private_file import open_private
from vla_deploy.gateways.ros.applying import ParameterEffects, effects_of
from vla_deploy.gateways.ros.errors import ParametersUnusable
from vla_deploy.gateways.ros.parameters import (
    API_KEY,
    API_KEY_VARIABLE,
    PARAMETERS,
    PARAMETERS_KEY,
    PARAMS_FILE_VARIABLE,
    SECTIONS,
    handed_over_parameters,
)
from vla_deploy.model_servers.credentials import GIVEN_FOLDER
from vla_deploy.model_servers.settings import (
    SERVERS_FILE,
    Api,
    Location,
    ServerSettings,
    read_servers,
)
from vla_deploy.robots import load_robot
from vla_deploy.robots.loader import OVERRIDES_FILE, ROBOT_FILE, read_overrides, robot_file
from vla_deploy.runtime.state_dir import config_dir_of
from vla_deploy.supervisor.runs.options import RunOptions
from vla_deploy.supervisor.runs.runtime import default_base, free_base

DERIVED_DIR: Final = GIVEN_FOLDER.partition("/")[0]
_HEADER: Final = "# Derived from the parameters in {file}; the next start writes it anew.\n"
_GATEWAY: Final = "ros"
_DEFAULTS: Final = {one.name: one.default for one in PARAMETERS}
_APIS: Final = {"anthropic": Api.ANTHROPIC, "openai": Api.OPENAI}
_URLS: Final = {"anthropic": "https://api.anthropic.com", "openai": "https://api.openai.com/v1"}
_LOCAL_HOSTS: Final = frozenset({"localhost", "127.0.0.1", "::1"})
_OLLAMA_PORT: Final = 11434
Values = Mapping[str, Any]
_log = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True, kw_only=True)
class ServerChoice:
    """Name the chosen server, "" for none; `fault` says what must be declared first."""

    name: str = ""
    fault: str = ""
    notes: tuple[str, ...] = ()


def with_parameters(
    options: RunOptions,
    params_file: Path | None = None,
    environment: MutableMapping[str, str] = os.environ,
) -> RunOptions:
    """Return the options changed by a parameter file, given here or named by the environment.

    The API key is removed from the environment, and handed over in a file of mode 600.

    Raises:
        ParametersUnusable: the file cannot be used, or asks for what cannot be.
        AlreadyRunning: a robot runs in this runtime directory; its derived files are not changed.
        RuntimeUnavailable: the runtime directory cannot be used.
        RobotFileError: the robot cannot be used.
        ProfileError: the profile cannot be used.
        ModelServerError: servers.toml cannot be used.
    """
    key = environment.pop(API_KEY_VARIABLE, "")
    handed_over = environment.get(PARAMS_FILE_VARIABLE, "")
    if params_file is None and not handed_over:
        return options
    file = str(Path(params_file or handed_over).absolute())
    given = handed_over_parameters({PARAMS_FILE_VARIABLE: file, API_KEY_VARIABLE: key})
    base = options.runtime_base or default_base()
    effects = effects_of(given, load_robot(options.robot), load_profile(options.profile))
    servers_file = config_dir_of(base) / SERVERS_FILE
    servers = read_servers(servers_file)
    choice = chosen_server(given, servers, servers_file)
    if faults := [*effects.faults, *([choice.fault] if choice.fault else ())]:
        raise ParametersUnusable(f"{file}: {'; '.join(faults)}")
    key = str(given.get(API_KEY, ""))
    credential, note = _credential(key, choice, servers)
    free_base(base)
    folder = base / DERIVED_DIR
    shutil.rmtree(folder, ignore_errors=True)
    if credential:
        _give_key(base / GIVEN_FOLDER / credential, key)
    _log.info("parameters: %s", file)
    return replace(
        options,
        robot=str(_derived_robot(options.robot, effects, folder, file)),
        profile=str(_derived_profile(options.profile, effects, choice, folder, file)),
        variables={
            _GATEWAY: {PARAMS_FILE_VARIABLE: str(_derived_parameters(given, folder, file))},
        },
        notes=(*effects.notes, *choice.notes, *([note] if note else ())),
    )


def _credential(
    key: str, choice: ServerChoice, servers: Mapping[str, ServerSettings]
) -> tuple[str, str]:
    """Return the name by which the planner finds the key, or why it needs none."""
    if not key:
        return "", ""
    credential = servers[choice.name].credential if choice.name else None
    if credential is None:
        return "", f"{API_KEY}: not used: no server is asked that wants one"
    return credential, ""


def _give_key(file: Path, key: str) -> None:
    handle = open_private(file, os.O_WRONLY | os.O_TRUNC)
    with os.fdopen(handle, "w", encoding="ascii") as opened:
        opened.write(key)


def _derived_robot(robot: str, effects: ParameterEffects, folder: Path, file: str) -> Path:
    """Copy the robot's folder and write the changed values as overrides."""
    own = robot_file(robot)
    derived = folder / "robots" / own.parent.resolve().name
    shutil.copytree(own.parent, derived)
    overrides, _ = read_overrides(derived)
    text = _HEADER.format(file=file) + toml_lines(merged(overrides, effects.robot))
    (derived / OVERRIDES_FILE).write_text(text, encoding="utf-8")
    return derived if own.name == ROBOT_FILE else derived / own.name


def _derived_profile(
    profile: str, effects: ParameterEffects, choice: ServerChoice, folder: Path, file: str
) -> Path:
    """Write a profile that inherits the chosen one, next to copies of those that are files."""
    source = read_source(profile)
    (folder / "profiles").mkdir(parents=True)
    for name in (source.name, *source.parents):
        if profile.endswith(".toml") and (own := source.path.with_name(f"{name}.toml")).is_file():
            shutil.copy(own, folder / "profiles")
    planning = dict(effects.profile)
    if choice.name:
        others = load_profile(profile).planning.servers
        planning["servers"] = [choice.name, *(one for one in others if one != choice.name)]
    derived = folder / "profiles" / f"{source.name}_with_parameters.toml"
    document = {"inherits": source.name} | ({"planning": planning} if planning else {})
    derived.write_text(_HEADER.format(file=file) + toml_lines(document), encoding="utf-8")
    return derived


def _derived_parameters(given: Mapping[str, Any], folder: Path, file: str) -> Path:
    """Write the given parameters for the gateway, without the key."""
    shown = {one.name: given[one.name] for one in PARAMETERS if one.name in given}
    shown.pop(API_KEY, None)
    derived = folder / "parameters.yaml"
    document = {SECTIONS[0]: {PARAMETERS_KEY: shown}}
    text = _HEADER.format(file=file) + yaml.safe_dump(document, allow_unicode=True)
    derived.write_text(text, encoding="utf-8")
    return derived


def chosen_server(
    given: Values, declared: Mapping[str, ServerSettings], file: Path
) -> ServerChoice:
    """Return the server of `servers.toml`, here `file`, that the parameters name.

    The default name of the local model counts as none: every parameter file has it.
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
        f"add, and change as needed (docs/language-models.md):\n{lines}"
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
    return "localhost" if host in _LOCAL_HOSTS else host, port or {"http": 80, "https": 443}.get(
        parts.scheme
    )
