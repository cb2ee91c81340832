"""`vla-deploy devices` prints what the run knows of devices, or what they say themselves."""

from collections.abc import Callable
from contextlib import closing
from pathlib import Path
from typing import Any

import pytest

from drivers.clock import MonotonicClock
from sim_twin.home.appliances import EmulatedHome
from vla_deploy.devices import home
from vla_deploy.ipc import SharedSpace
from vla_deploy.robots import load_robot

LAMP = {"name": "lamp", "kind": "lamp", "place": "hall", "called": "L1", "where": "x on y"}


def publish(run_dir: Path, devices: list[dict[str, Any]]) -> None:
    with closing(SharedSpace(run_dir / "ipc", MonotonicClock())) as space:
        space.cell_writer("device_status").put_document({"devices": devices})


def test_the_runs_devices_are_listed_with_state_age_and_reason(
    run_dir: Path, vla: Callable[..., Any]
) -> None:
    devices = [
        {**LAMP, "is_on": True, "age_s": 1.25, "fault": ""},
        {**LAMP, "is_on": None, "age_s": None, "fault": "the broker cannot be reached"},
    ]
    publish(run_dir, devices)
    said = vla("devices")
    assert said.code == 0
    on, unknown = said.out.splitlines()[1:]
    assert on.split()[:5] == ["lamp", "lamp", "hall", "on", "1.2"]
    assert on.endswith('x on y, calls itself "L1"')
    assert unknown.split()[3] == "unknown"
    assert unknown.endswith("the broker cannot be reached")
    assert vla("devices", "--json").document == {"devices": devices}


def test_without_any_it_says_where_they_are_declared(
    run_dir: Path, vla: Callable[..., Any]
) -> None:
    publish(run_dir, [])
    assert "docs/devices.md" in vla("devices").out


def test_devices_answer_also_where_no_robot_runs(
    tmp_path: Path, vla: Callable[..., Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    emulated = EmulatedHome(load_robot("butler"), tmp_path / "mqtt")
    transport_of = home.transport_of
    monkeypatch.setattr(
        home, "transport_of", lambda robot, one, _: transport_of(robot, one, tmp_path / "mqtt")
    )
    emulated.appliances["lamp"].press()
    states = vla("devices", "--robot", "butler", "--json").document["devices"]
    assert {one["name"]: one["is_on"] for one in states} == {"lamp": True, "socket": False}
    emulated.close()
