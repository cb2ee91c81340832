"""A file that nests without end is one fault, as any other, and no traceback."""

from collections.abc import Callable
from pathlib import Path

import pytest

from vla_deploy.gateways.ros.parameters import (
    PARAMS_FILE_VARIABLE,
    ParametersUnusable,
    handed_over_parameters,
)
from vla_deploy.robots import load_robot
from vla_deploy.robots.errors import RobotFileError
from vla_deploy.robots.maps.map_file import MapInvalid, read_map_file
from vla_deploy.runtime.net import DashboardSettingsInvalid, read_settings

DEPTH = 3000
NESTED = "[" * DEPTH + "]" * DEPTH
TOML, YAML = f"deep = {NESTED}\n", f"deep: {NESTED}\n"
ROBOT_FILES = {
    "robot.toml": TOML,
    "overrides.toml": TOML,
    "calibration.toml": TOML,
    "camera_mounting.toml": TOML,
    "camera.yaml": YAML,
}


def parameters_of(file: Path) -> object:
    return handed_over_parameters({PARAMS_FILE_VARIABLE: str(file)})


@pytest.mark.parametrize("name", ROBOT_FILES)
def test_of_a_robot(butler_copy: Path, name: str) -> None:
    (butler_copy.parent / name).write_text(ROBOT_FILES[name])
    with pytest.raises(RobotFileError, match="nested too deeply"):
        load_robot(str(butler_copy))


@pytest.mark.parametrize(
    ("read", "text", "error"),
    [
        (lambda file: read_settings(file.parent), TOML, DashboardSettingsInvalid),
        (read_map_file, YAML, MapInvalid),
        (parameters_of, YAML, ParametersUnusable),
    ],
)
def test_of_settings_maps_and_parameters(
    tmp_path: Path, read: Callable[[Path], object], text: str, error: type[Exception]
) -> None:
    folder = tmp_path.with_name(f"{tmp_path.name}-config")
    folder.mkdir()
    for file in (folder / "dashboard.toml", tmp_path / "deep"):
        file.write_text(text)
    with pytest.raises(error, match="nested too deeply"):
        read(tmp_path / "deep")
