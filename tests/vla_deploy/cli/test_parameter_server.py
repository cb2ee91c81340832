"""The server of servers.toml that the parameters name is found, or the lines to declare it told."""

from pathlib import Path
from typing import Any

import pytest

from vla_deploy.cli.parameter_server import ServerChoice, chosen_server, server_lines
from vla_deploy.model_servers.servers_file import read_servers

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
CLOUD = {"vlm_provider": "anthropic", "vlm_model": "claude-haiku-4-5"}
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
