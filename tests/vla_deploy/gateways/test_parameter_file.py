"""A run by a parameter file: derived robot and profile, the chosen model server, the key."""

import shutil
import stat
from pathlib import Path
from typing import Any

import pytest
import yaml

from platforms import load_profile
from vla_deploy.cli.main import main
from vla_deploy.gateways.parameter_file import (
    ServerChoice,
    chosen_server,
    server_lines,
    with_parameters,
)
from vla_deploy.gateways.ros.errors import ParametersUnusable
from vla_deploy.gateways.ros.parameters import (
    API_KEY_VARIABLE,
    PARAMETERS,
    PARAMS_FILE_VARIABLE,
    handed_over_parameters,
)
from vla_deploy.model_servers.credentials import GIVEN_FOLDER, find_credential, key_folders
from vla_deploy.model_servers.settings import read_servers
from vla_deploy.robots import load_robot
from vla_deploy.robots.loader import ROBOTS_DIR
from vla_deploy.supervisor.errors import AlreadyRunning
from vla_deploy.supervisor.runs.options import RunOptions
from vla_deploy.supervisor.runs.runtime import Runtime

KEY = "key-of-nobody"
SERVERS = """
[servers.cloud]
api = "anthropic"
url = "https://api.anthropic.com"
model = "claude-haiku-4-5"
location = "remote"
credential = "house_key"
"""
CLOUD = {"vlm_provider": "anthropic", "vlm_model": "claude-haiku-4-5"}


@pytest.fixture
def base(tmp_path: Path) -> Path:
    (tmp_path / "base-config").mkdir()
    (tmp_path / "base-config" / "servers.toml").write_text(SERVERS)
    return tmp_path / "base"


@pytest.fixture
def derived(base: Path, tmp_path: Path):
    """Return what a run becomes by these parameters."""

    def derive(options: dict[str, Any], **given: Any) -> RunOptions:
        file = tmp_path / "parameters.yaml"
        file.write_text(yaml.safe_dump({"/**": {"ros__parameters": given}}))
        environment = {PARAMS_FILE_VARIABLE: str(file), API_KEY_VARIABLE: KEY}
        changed = with_parameters(RunOptions(runtime_base=base, **options), environment=environment)
        assert API_KEY_VARIABLE not in environment
        return changed

    return derive


def test_without_a_file_nothing_changes_but_the_key_goes() -> None:
    options, environment = RunOptions(), {API_KEY_VARIABLE: KEY}
    assert with_parameters(options, environment=environment) is options
    assert environment == {}


def test_robot_and_profile_are_derived_below_the_base(derived, base: Path) -> None:
    options = derived({}, max_speed=0.2, plan_timeout=12.0, restricted_areas=["kitchen"])
    assert Path(options.robot).is_relative_to(base)
    robot, own = load_robot(options.robot), load_robot("butler")
    assert robot.base.max_speed_m_s == 0.2
    assert robot.home.zones[:-1] == own.home.zones
    assert robot.servo_bus == own.servo_bus
    profile = load_profile(options.profile)
    assert profile.planning.within_s == 12.0
    assert profile.budgets == load_profile("desktop").budgets
    assert options.seed == 0


def test_nothing_is_left_of_the_parameters_before(derived) -> None:
    assert load_robot(derived({}, max_speed=0.2).robot).base.max_speed_m_s == 0.2
    assert load_robot(derived({}, plan_timeout=5.0).robot).base.max_speed_m_s == 0.5


def test_overrides_that_a_robot_has_stay(derived, tmp_path: Path) -> None:
    folder = shutil.copytree(ROBOTS_DIR / "butler", tmp_path / "mine")
    (folder / "overrides.toml").write_text(
        "[base]\ntrack_m = 0.4\nmax_speed_m_s = 0.4\n[poses.'odd name']\nhead_pan = 0.1\n"
    )
    for given in (folder, folder / "robot.toml"):
        robot = load_robot(derived({"robot": str(given)}, max_speed=0.2).robot)
        assert (robot.base.track_m, robot.base.max_speed_m_s) == (0.4, 0.2)
        assert robot.poses["odd name"] == {"head_pan": 0.1}
    assert load_robot(folder).base.max_speed_m_s == 0.4


def test_a_profile_that_is_a_file_is_inherited_with_its_parents(derived, tmp_path: Path) -> None:
    (tmp_path / "elder.toml").write_text("inherits = 'desktop'\ncamera_rate_hz = 7\n")
    (tmp_path / "mine.toml").write_text("inherits = 'elder'\nperception_rate_hz = 3\n")
    options = derived({"profile": str(tmp_path / "mine.toml")}, max_memory_items=9)
    profile = load_profile(options.profile)
    assert (profile.camera_rate_hz, profile.perception_rate_hz) == (7, 3)
    assert profile.planning.remembered == 9


def test_the_key_reaches_the_planner_in_a_file_of_its_own_and_nothing_else(
    derived, base: Path
) -> None:
    options = derived({}, **CLOUD)
    assert load_profile(options.profile).planning.servers == ("cloud",)
    assert find_credential("house_key", key_folders(base, {})).reveal() == KEY
    assert KEY not in str(options.variables) + repr(options)
    assert stat.S_IMODE((base / GIVEN_FOLDER / "house_key").stat().st_mode) == 0o600
    written = [file.read_text() for file in base.rglob("*") if file.suffix in (".toml", ".yaml")]
    assert written
    assert not any(KEY in text for text in written)


def test_a_key_that_nobody_wants_is_told(derived) -> None:
    options = derived({}, max_speed=0.2)
    assert "planner" not in options.variables
    assert "vlm_api_key: not used: no server is asked that wants one" in options.notes


def test_the_gateway_gets_all_but_the_key(derived) -> None:
    given = {one.name: one.default for one in PARAMETERS} | {"vlm_api_key": "in the file"}
    options = derived({}, **given)
    del given["vlm_api_key"]
    assert handed_over_parameters(options.variables["ros"]) == given


def test_all_that_cannot_be_is_told_at_once(derived, base: Path) -> None:
    with pytest.raises(ParametersUnusable) as told:
        derived({}, restricted_areas=["dock"], vlm_provider="openai", vlm_model="gpt-5")
    assert "parameters.yaml: restricted_areas: expected places away from" in str(told.value)
    assert '[servers.openai]\n  model = "gpt-5"' in str(told.value)
    assert not base.exists()


def test_a_robot_that_runs_is_left_as_it_is(derived, base: Path) -> None:
    robot = derived({}, max_speed=0.2).robot
    runtime = Runtime(base)
    try:
        with pytest.raises(AlreadyRunning):
            derived({}, max_speed=0.3)
    finally:
        runtime.close()
    assert load_robot(robot).base.max_speed_m_s == 0.2


def test_run_refuses_in_words(base: Path, tmp_path: Path, capsys) -> None:
    file = tmp_path / "wrong.yaml"
    file.write_text("/**: {ros__parameters: {max_speed: fast, plan_timeout: never}}")
    words = ["--runtime-base", str(base), "run", "--twin", "--params-file", str(file)]
    assert main(words) == 2
    told = capsys.readouterr().err
    assert "max_speed: expected a number in 0.01..5, got 'fast'" in told
    assert "plan_timeout: expected a number" in told


DECLARED = """
[servers.bench]
api = "openai_compatible"
url = "http://127.0.0.1:8080/v1"
model = "qwen3-vl-4b"
location = "local"

[servers.cloud]
api = "anthropic"
url = "https://api.anthropic.com"
model = "claude-haiku-4-5"
location = "remote"
credential = "anthropic_api_key"
allow_text_off_robot = true
"""
BENCH = {"vlm_provider": "local", "local_vlm_model": "qwen3-vl-4b"}


@pytest.fixture
def chosen(tmp_path: Path):
    file = tmp_path / "servers.toml"
    file.write_text(DECLARED)
    return lambda **given: chosen_server(given, read_servers(file), file)


@pytest.mark.parametrize(
    ("given", "name"),
    [
        ({}, ""),
        ({"vlm_provider": "anthropic"}, ""),
        ({"local_vlm_model": "llava:13b"}, ""),  # the default that every parameter file has
        (CLOUD, "cloud"),
        (BENCH, "bench"),
        ({**BENCH, "local_vlm_url": "http://localhost:8080"}, "bench"),
        ({**CLOUD, "local_vlm_model": "llava:13b"}, "cloud"),
    ],
)
def test_the_server_that_is_declared_is_chosen(chosen, given: dict[str, Any], name: str) -> None:
    assert chosen(**given) == ServerChoice(name=name)


def test_a_model_of_the_other_provider_is_told_not_to_be_asked(chosen) -> None:
    choice = chosen(**BENCH, vlm_model="claude-haiku-4-5")
    assert choice.name == "bench"
    assert choice.notes == ("vlm_model: claude-haiku-4-5 is not asked: vlm_provider is local",)


@pytest.mark.parametrize(
    "given",
    [
        {"vlm_provider": "openai", "vlm_model": "gpt-5"},
        {"vlm_provider": "anthropic", "vlm_model": 'a "new" one'},
        {"local_vlm_model": "llava:7b"},
        {"local_vlm_model": "llava:13b", "local_vlm_url": "http://localhost:8000"},
        {**BENCH, "local_vlm_url": "http://localhost:9090"},
    ],
)
def test_one_that_is_not_declared_is_a_fault_with_lines_that_mend_it(
    chosen, tmp_path: Path, given: dict[str, Any]
) -> None:
    choice = chosen(**given)
    assert choice.name == ""
    assert f"expected a server that {tmp_path / 'servers.toml'} declares with" in choice.fault
    lines = choice.fault.split("\n", 1)[1]
    file = tmp_path / "mended.toml"
    file.write_text(DECLARED + lines)
    assert chosen_server(given, read_servers(file), file).name not in ("", "bench", "cloud")


def test_the_lines_take_no_name_twice_and_hold_no_key() -> None:
    lines = server_lines({}, "anthropic", "x", taken=("anthropic", "anthropic_2"))
    assert lines[0] == "[servers.anthropic_3]"
    assert 'credential = "anthropic_api_key"' in lines
