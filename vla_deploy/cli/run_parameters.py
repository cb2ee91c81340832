"""Run the whole robot by a file of ROS parameters: derive a robot folder and a profile from it."""

import json
import logging
import os
import re
import shutil
from collections.abc import Mapping, MutableMapping
from dataclasses import replace
from pathlib import Path
from typing import Any, Final

import yaml

from platforms import load_profile
from platforms.profile_source import merged, read_source
from vla_deploy.cli.parameter_server import ServerChoice, chosen_server
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
from vla_deploy.model_servers.servers_file import SERVERS_FILE, read_servers
from vla_deploy.model_servers.settings import ServerSettings
from vla_deploy.robots import load_robot
from vla_deploy.robots.calibration.overrides import OVERRIDES_FILE, read_overrides
from vla_deploy.robots.loader import ROBOT_FILE, robot_file
from vla_deploy.runtime.state_dir import config_dir_of
from vla_deploy.supervisor.runs.options import RunOptions
from vla_deploy.supervisor.runs.runtime import default_base, free_base

DERIVED_DIR: Final = "with_parameters"
_HEADER: Final = "# Derived from the parameters in {file}; the next start writes it anew.\n"
_GATEWAY: Final = "ros"
_PLANNER: Final = "planner"
_log = logging.getLogger(__name__)


def with_parameters(
    options: RunOptions,
    params_file: Path | None = None,
    environment: MutableMapping[str, str] = os.environ,
) -> RunOptions:
    """Return what to run instead where a file of parameters is given, or was handed over.

    The key is taken out of the environment, for only the planner to get it.

    Raises:
        ParametersUnusable: the file cannot be used, or asks for what cannot be.
        AlreadyRunning: a robot runs in this runtime directory: what it runs by is not changed.
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
    credential, note = _credential(str(given.get(API_KEY, "")), choice, servers)
    free_base(base)
    folder = base / DERIVED_DIR
    shutil.rmtree(folder, ignore_errors=True)
    _log.info("parameters: %s", file)
    return replace(
        options,
        robot=str(_derived_robot(options.robot, effects, folder, file)),
        profile=str(_derived_profile(options.profile, effects, choice, folder, file)),
        variables={
            _GATEWAY: {PARAMS_FILE_VARIABLE: str(_derived_parameters(given, folder, file))},
            _PLANNER: credential,
        },
        notes=(*effects.notes, *choice.notes, *([note] if note else ())),
    )


def _credential(
    key: str, choice: ServerChoice, servers: Mapping[str, ServerSettings]
) -> tuple[dict[str, str], str]:
    """Return the variable in which the planner finds the key, or why it needs none."""
    if not key:
        return {}, ""
    credential = servers[choice.name].credential if choice.name else None
    if credential is None:
        return {}, f"{API_KEY}: not used: no server is asked that wants one"
    return {credential.upper(): key}, ""


def _derived_robot(robot: str, effects: ParameterEffects, folder: Path, file: str) -> Path:
    """Copy the robot's folder, and lay over it what the parameters change."""
    own = robot_file(robot)
    derived = folder / "robots" / own.parent.resolve().name
    shutil.copytree(own.parent, derived)
    overrides, _ = read_overrides(derived)
    text = _HEADER.format(file=file) + _as_toml(merged(overrides, effects.robot))
    (derived / OVERRIDES_FILE).write_text(text, encoding="utf-8")
    return derived if own.name == ROBOT_FILE else derived / own.name


def _derived_profile(
    profile: str, effects: ParameterEffects, choice: ServerChoice, folder: Path, file: str
) -> Path:
    """Write a profile that inherits the chosen one, beside copies of those that are files."""
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
    derived.write_text(_HEADER.format(file=file) + _as_toml(document), encoding="utf-8")
    return derived


def _derived_parameters(given: Mapping[str, Any], folder: Path, file: str) -> Path:
    """Write for the gateway what was given, without the key."""
    shown = {one.name: given[one.name] for one in PARAMETERS if one.name in given}
    shown.pop(API_KEY, None)
    derived = folder / "parameters.yaml"
    document = {SECTIONS[0]: {PARAMETERS_KEY: shown}}
    text = _HEADER.format(file=file) + yaml.safe_dump(document, allow_unicode=True)
    derived.write_text(text, encoding="utf-8")
    return derived


def _as_toml(table: Mapping[str, Any]) -> str:
    return "".join(f"{_key(key)} = {_inline(value)}\n" for key, value in table.items())


def _inline(value: Any) -> str:
    if isinstance(value, Mapping):
        rows = (f"{_key(key)} = {_inline(one)}" for key, one in value.items())
        return f"{{{', '.join(rows)}}}"
    if isinstance(value, list | tuple):
        return f"[{', '.join(map(_inline, value))}]"
    if isinstance(value, str | bool | int | float):
        return json.dumps(value, ensure_ascii=False)
    return str(value)  # a date, as tomllib reads it


def _key(key: str) -> str:
    return key if re.fullmatch(r"[A-Za-z0-9_-]+", key) else json.dumps(key, ensure_ascii=False)
