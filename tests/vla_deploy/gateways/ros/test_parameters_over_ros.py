"""A file of parameters holds for the whole robot, and the graph shows what holds."""

import os
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import psutil
import pytest
import yaml

from sim_twin.harness.processes import ProcessStack, armed_processes
from vla_deploy.gateways.ros.parameters import API_KEY_VARIABLE, PARAMETERS

pytestmark = [pytest.mark.stack, pytest.mark.gl, pytest.mark.timeout(900)]

CLIENT = Path(__file__).with_name("parameters_client.py").read_text(encoding="utf-8")
KEY = "key-of-nobody"
GIVEN = {
    "max_speed": 0.3,
    "restricted_areas": ["coffee table", "stairs"],
    "plan_timeout": 12.0,
    "max_replan_attempts": 1,
    "max_memory_items": 50,
    "action_timeout": 90.0,
    "vlm_provider": "anthropic",
    "vlm_model": "claude-haiku-4-5",
}
SERVERS = """
[servers.cloud]
api = "anthropic"
url = "https://127.0.0.1:9"
model = "claude-haiku-4-5"
location = "remote"
credential = "house_key"
"""


@pytest.fixture
def robot(
    ros_domain: int,
    coarse: str,
    tmp_path: Path,
    tmp_path_factory: pytest.TempPathFactory,
    monkeypatch: pytest.MonkeyPatch,
) -> Iterator[ProcessStack]:
    base = tmp_path_factory.mktemp("ros")
    config = base.with_name(f"{base.name}-config")
    config.mkdir()
    (config / "servers.toml").write_text(SERVERS)
    file = tmp_path / "parameters.yaml"
    file.write_text(yaml.safe_dump({"cognitive_robot": {"ros__parameters": GIVEN}}))
    monkeypatch.setenv("ROS_DOMAIN_ID", str(ros_domain))
    monkeypatch.setenv(API_KEY_VARIABLE, KEY)
    words = ("--ros", "--profile", coarse, "--params-file", str(file))
    with armed_processes(base, *words) as stack:
        yield stack


def holders_of(key: str, robot: ProcessStack) -> set[str]:
    """Return the processes of the robot in whose environment a key is."""
    rows = robot.document("process_table")["processes"]
    pids = {row["pid"]: row["name"] for row in rows if row["pid"] is not None}
    return {
        name
        for pid, name in pids.items()
        if any(key in value for value in psutil.Process(pid).environ().values())
    }


def test_parameters_hold_and_are_shown_and_are_not_set_at_run_time(
    ros_graph: Any, robot: ProcessStack
) -> None:
    told = ros_graph.run(CLIENT, timeout_s=600.0)
    expected = GIVEN | {"restricted_areas": ["coffee table"], "vlm_api_key": ""}
    values = told["values"]
    assert {one.name for one in PARAMETERS} <= set(values)
    assert {name: values[name] for name in expected} == expected

    speed = told["described"]["max_speed"]
    assert speed == {"description": "of the base, m/s", "read_only": True, "ranges": [[0.01, 5.0]]}
    assert all(told["described"][one.name]["read_only"] for one in PARAMETERS)
    assert told["set"] == [
        [False, f"{name}: read-only; set it in the parameter file and start again"]
        for name in ("max_speed", "restricted_areas")
    ]
    assert told["speed_then"] == 0.3

    assert told["restricted"]["status"] == "aborted"
    assert "the parameter restricted_areas keeps the robot out of it" in told["restricted"]["error"]
    assert told["fast"]["status"] == "aborted"
    assert "0.4 m/s asked, 0.3 m/s at most" in told["fast"]["error"]
    assert told["free"]["status"] == "succeeded", told["free"]

    assert holders_of(KEY, robot) == set()  # the planner reads it from a file
    log = (robot.run_dir / "logs" / "supervisor.log").read_text()
    assert "no such place on the map, so nothing to keep out of: stairs" in log
    assert os.environ[API_KEY_VARIABLE] == KEY  # this test's own
