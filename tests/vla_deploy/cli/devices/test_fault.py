"""`vla-deploy fault` against a socket that answers as the twin does."""

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import pytest

from drivers.clock import MonotonicClock
from vla_deploy.ipc import SharedSpace

Fault = Callable[..., Any]


class Twin:
    """Answer each request with what was prepared, and keep what was asked."""

    def __init__(self) -> None:
        self.asked: list[dict[str, Any]] = []
        self.answer: dict[str, Any] = {"ok": True}

    def take(self, request: dict[str, Any]) -> dict[str, Any]:
        self.asked.append(request)
        return self.answer


@pytest.fixture
def twin(run_dir: Path, serve_twin: Callable[..., Any]) -> Twin:
    twin = Twin()
    serve_twin(run_dir, twin.take)
    return twin


@pytest.fixture
def fault(vla: Fault) -> Fault:
    return partial(vla, "fault")


@pytest.mark.parametrize(
    "words", [("list",), ("inject", "servo", "off", "3"), ("clear",), ("run", "servo_off")]
)
def test_a_run_without_a_twin_is_refused_in_one_line(
    fault: Fault, run_dir: Path, words: tuple[str, ...]
) -> None:
    said = fault(*words)
    assert (said.code, said.out, said.err.count("\n")) == (2, "", 1)
    assert "this run has no twin" in said.err
    assert "vla-deploy run --twin" in said.err


def test_a_fault_is_sent_as_it_was_typed(fault: Fault, twin: Twin) -> None:
    twin.answer = {"ok": True, "injected": {"id": 4, "fault": "servo left_elbow: delayed"}}
    words = ("inject", "servo", "delayed", "left_elbow", "--start", "1", "--for", "2.5")
    said = fault(*words, "--set", "delay_s=0.02", "--seed", "7")
    assert twin.asked == [
        {
            "op": "fault_inject",
            "component": "servo",
            "fault": "delayed",
            "instance": "left_elbow",
            "start_s": 1.0,
            "duration_s": 2.5,
            "delay_s": 0.02,
            "seed": 7,
        }
    ]
    assert (said.code, said.out) == (0, "fault 4: servo left_elbow: delayed\n")


def test_the_refusal_of_the_twin_is_one_line(fault: Fault, twin: Twin) -> None:
    twin.answer = {"ok": False, "error": "servo: there is no fault 'echo' here"}
    said = fault("inject", "servo", "echo")
    assert said.code == 2
    assert said.err == "vla-deploy: the twin refuses: servo: there is no fault 'echo' here\n"


def test_a_setting_without_a_number_is_refused(fault: Fault, twin: Twin) -> None:
    said = fault("inject", "servo_bus", "brown_out", "--set", "volts=low")
    assert said.code == 2
    assert "--set volts=low: expected NAME=NUMBER" in said.err
    assert twin.asked == []


def test_clear_names_what_is_left(fault: Fault, twin: Twin) -> None:
    twin.answer = {"ok": True, "pending": [{"id": 2, "fault": "lidar: off", "on": True}]}
    said = fault("clear", "1")
    assert twin.asked == [{"op": "fault_clear", "id": 1}]
    assert (said.code, said.out) == (0, "fault 2: lidar: off (on)\n")


def test_list_prints_what_can_fail_with_its_parameters(fault: Fault, twin: Twin) -> None:
    parameter = {"name": "volts_v", "default": 4.0, "range": [0.0, 30.0], "meaning": "drop"}
    row = {"fault": "brown_out", "summary": "the supply sags", "parameters": [parameter]}
    twin.answer = {
        "ok": True,
        "catalogue": [{"component": "servo_bus", "instances": {}, "faults": [row]}],
        "scenarios": ["servo_off"],
        "pending": [],
    }
    said = fault("list")
    assert "brown_out         the supply sags; volts_v=4 (0..30)" in said.out
    assert "no fault is in force" in said.out
    assert fault("list", "--json").document["scenarios"] == ["servo_off"]


def test_a_scenario_file_is_sent_as_text_and_its_cause_is_awaited(
    fault: Fault, twin: Twin, tmp_path: Path
) -> None:
    path = tmp_path / "mine.toml"
    path.write_text("summary = 'x'")
    twin.answer = {
        "ok": True,
        "scenario": "mine",
        "summary": "x",
        "meanwhile": "hold",
        "end_s": -0.9,
        "expect": {"cause": "servo_bus_lost"},
    }
    said = fault("run", path)
    assert said.code == 1
    assert twin.asked == [{"op": "fault_run", "name": "mine", "text": "summary = 'x'"}]
    assert "cause none, state silent; expected cause servo_bus_lost" in said.err


@pytest.mark.parametrize(
    ("name", "complaint"),
    [
        ("none.toml", "none.toml: No such file or directory; expected a scenario's TOML file"),
        ("folder/none", "folder/none: No such file or directory"),
        (".", "Is a directory; expected a scenario's TOML file"),
        ("noise.toml", "noise.toml: got 'utf-8' codec can't decode byte"),
    ],
)
def test_a_scenario_file_that_cannot_be_read_is_refused_in_one_line(
    fault: Fault, twin: Twin, tmp_path: Path, name: str, complaint: str
) -> None:
    (tmp_path / "noise.toml").write_bytes(b"\xfe\xff\x00")
    said = fault("run", f"{tmp_path}/{name}")
    assert said.code == 2
    assert complaint in said.err
    assert said.err.count("\n") == 1
    assert twin.asked == []


def test_a_robot_that_is_stopped_already_is_not_judged_by_that_cause(
    fault: Fault, twin: Twin, run_dir: Path
) -> None:
    space = SharedSpace(run_dir / "ipc", MonotonicClock())
    status = {"state": "stopped", "cause": "servo_bus_lost"}
    space.cell_writer("control_status").put_document(status)
    said = fault("run", "servo_off")
    space.close()
    assert said.code == 2
    assert "control is stopped already, cause servo_bus_lost" in said.err
    assert twin.asked == []
