"""List the parameters of the gateway's node, and read where their values were handed over.

The names are an interface: users' parameter files have them. The launch file of the ROS package
`vla_deploy` names a file and a key in two variables of the environment; `vla-deploy run` takes both
up before anything starts (`applying`), and passes the key on to the planner alone.
"""

import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import yaml

from vla_deploy.gateways.ros.errors import ParametersUnusable

PARAMS_FILE_VARIABLE: Final = "VLA_DEPLOY_ROS_PARAMS_FILE"
API_KEY_VARIABLE: Final = "VLA_DEPLOY_ROS_VLM_API_KEY"
# The gateway's node may be named by a file as in ROS's examples, or as our users' files name it.
SECTIONS: Final = ("/**", "cognitive_robot", "cognitive_planner", "vla_deploy", "/vla_deploy")
API_KEY: Final = "vlm_api_key"
PARAMETERS_KEY: Final = "ros__parameters"
Value = str | bool | int | float | list[str]


_KINDS: Final[Mapping[type, str]] = {
    bool: "true or false",
    float: "a number",
    int: "a whole number",
    list: "a list of texts",
    str: "a text",
}


@dataclass(frozen=True, slots=True, kw_only=True)
class RosParameter:
    """Declare one parameter; numbers are within `low` and `high`, `choices` are all there are."""

    name: str
    default: Value
    description: str
    low: float | None = None
    high: float | None = None
    choices: tuple[str, ...] = ()

    @property
    def expected(self) -> str:
        """Return in words what a value must be."""
        if self.choices:
            return f"one of {', '.join(self.choices)}"
        if self.low is not None:
            return f"{_KINDS[type(self.default)]} in {self.low:g}..{self.high:g}"
        return _KINDS[type(self.default)]

    def allows(self, value: object) -> bool:
        """Return whether a value is of the parameter's type and within its bounds."""
        kind = type(self.default)
        if not (type(value) is kind or (kind is float and type(value) is int)):
            return False
        if isinstance(value, list):
            return all(isinstance(one, str) for one in value)
        if isinstance(value, int | float) and self.low is not None and self.high is not None:
            return self.low <= value <= self.high
        return not self.choices or value in self.choices


PARAMETERS: Final[tuple[RosParameter, ...]] = (
    RosParameter(
        name="vlm_provider",
        default="local",
        description="which model may be asked beside those on board",
        choices=("anthropic", "openai", "local"),
    ),
    RosParameter(name="vlm_model", default="", description="its name at the provider"),
    RosParameter(name=API_KEY, default="", description="key of the provider; never shown"),
    RosParameter(
        name="local_vlm_url",
        default="http://localhost:11434",
        description="address of the server where the provider is local",
    ),
    RosParameter(
        name="local_vlm_model",
        default="llava:13b",
        description="name of the model where the provider is local",
    ),
    RosParameter(
        name="max_replan_attempts",
        default=3,
        description="further plans for one command after setbacks",
        low=0,
        high=20,
    ),
    RosParameter(
        name="plan_timeout", default=30.0, description="for one plan, s", low=0.1, high=600.0
    ),
    RosParameter(
        name="action_timeout",
        default=60.0,
        description="for one action, s; 60 leaves each skill its own",
        low=0.1,
        high=3600.0,
    ),
    RosParameter(
        name="require_confirmation",
        default=True,
        description="ask before a risky plan is carried out",
    ),
    RosParameter(name="max_speed", default=0.5, description="of the base, m/s", low=0.01, high=5.0),
    RosParameter(
        name="restricted_areas",
        default=["stairs", "outside"],
        description="places where the robot must not go",
    ),
    RosParameter(
        name="enable_memory", default=True, description="remember commands and what became of them"
    ),
    RosParameter(
        name="max_memory_items", default=100, description="how many of them", low=0, high=100_000
    ),
    RosParameter(
        name="planning_rate",
        default=1.0,
        description="changes nothing: commands and setbacks are planned for as they come; Hz",
        low=0.01,
        high=50.0,
    ),
    RosParameter(
        name="replan_on_failure", default=True, description="look for another plan after a setback"
    ),
)


def handed_over_parameters(inherited: Mapping[str, str] = os.environ) -> dict[str, object]:
    """Return the values that were handed over, by parameter, such as for `parameter_overrides`.

    Those of the table are of its types, and within its bounds; others, such as `use_sim_time`, are
    as they stand in the file.

    Raises:
        ParametersUnusable: the file cannot be read, or has faults: all of them are listed.
    """
    file = inherited.get(PARAMS_FILE_VARIABLE, "")
    values = _read(Path(file)) if file else {}
    if key := inherited.get(API_KEY_VARIABLE, ""):
        values[API_KEY] = key
    declared = {one.name: one for one in PARAMETERS}
    known = [(declared[name], value) for name, value in values.items() if name in declared]
    if faults := [fault for parameter, value in known if (fault := _fault(parameter, value))]:
        raise ParametersUnusable(f"{file}: {'; '.join(faults)}")
    return values | {
        one.name: float(value)
        for one, value in known
        if isinstance(value, int) and isinstance(one.default, float)
    }


def _read(file: Path) -> dict[str, object]:
    """Return the parameters of every section that is about our node, later ones before earlier."""
    try:
        document = yaml.safe_load(file.read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError, yaml.YAMLError, RecursionError) as error:
        raise ParametersUnusable(
            f"{file}: cannot read this file of parameters: {_why(error)}; give another file, "
            "or none, by the launch argument params_file or the option --params-file"
        ) from None  # the cause may show a line with a key
    sections = document if isinstance(document, dict) else {}
    rows = [sections[name] for name in SECTIONS if name in sections]
    found = [row.get(PARAMETERS_KEY) if isinstance(row, dict) else None for row in rows]
    if not found or not all(isinstance(row, dict) for row in found):
        names = ", ".join(map(str, sections)) or "nothing"
        raise ParametersUnusable(
            f"{file}: no parameters of this node; expected one of the sections "
            f"{', '.join(SECTIONS)} with {PARAMETERS_KEY} in it, got {names}"
        )
    return {str(name): value for row in found if row for name, value in row.items()}


def _fault(parameter: RosParameter, value: object) -> str:
    """Return what is wrong with a value, empty if nothing is."""
    if parameter.allows(value):
        return ""
    got = f"one of type {type(value).__name__}" if parameter.name == API_KEY else repr(value)
    return f"{parameter.name}: expected {parameter.expected}, got {got}"


def _why(error: Exception) -> str:
    if isinstance(error, yaml.MarkedYAMLError) and error.problem_mark is not None:
        return f"line {error.problem_mark.line + 1}: {error.problem}"
    if isinstance(error, RecursionError):
        return "it is nested too deeply"
    return error.strerror or str(error) if isinstance(error, OSError) else type(error).__name__
