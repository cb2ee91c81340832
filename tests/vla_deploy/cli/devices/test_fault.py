"""`vla-deploy fault` against a socket that answers as the twin does."""

import json
import os
import socket
import threading
from collections.abc import Iterator
from pathlib import Path

import pytest

from drivers.clock import MonotonicClock
from vla_deploy.cli.main import main
from vla_deploy.ipc import SharedSpace
from vla_deploy.supervisor.runtime import own_start_ticks


class Twin:
    """Answer each request with what was prepared, and keep what was asked."""

    def __init__(self, path: Path) -> None:
        self.asked: list[dict] = []
        self.answer: dict = {"ok": True}
        self._listener = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        self._listener.bind(str(path))
        self._listener.listen()
        self._thread = threading.Thread(target=self._serve, daemon=True)
        self._thread.start()

    def _serve(self) -> None:
        while True:
            try:
                client, _ = self._listener.accept()
            except OSError:
                return
            with client, client.makefile("rwb") as stream:
                self.asked.append(json.loads(stream.readline()))
                stream.write(json.dumps(self.answer).encode() + b"\n")
                stream.flush()

    def close(self) -> None:
        self._listener.shutdown(socket.SHUT_RDWR)
        self._listener.close()
        self._thread.join()


@pytest.fixture
def base(tmp_path: Path) -> Path:
    """Return a runtime directory in which this process runs a robot."""
    run_dir = tmp_path / "run"
    (run_dir / "dev").mkdir(parents=True)
    owner = {
        "pid": os.getpid(),
        "start_ticks": own_start_ticks(),
        "run_id": "run",
        "run_dir": str(run_dir),
    }
    (tmp_path / "lock").write_text(json.dumps(owner))
    return tmp_path


@pytest.fixture
def twin(base: Path) -> Iterator[Twin]:
    twin = Twin(base / "run" / "dev" / "referee")
    yield twin
    twin.close()


def fault(base: Path, *words: str) -> int:
    return main(["--runtime-base", str(base), "fault", *words])


def test_without_a_run_it_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert fault(tmp_path, "list") == 2
    assert "no robot runs" in capsys.readouterr().err


@pytest.mark.parametrize(
    "words", [("list",), ("inject", "servo", "off", "3"), ("clear",), ("run", "servo_off")]
)
def test_a_run_without_a_twin_is_refused_in_one_line(
    base: Path, words: tuple[str, ...], capsys: pytest.CaptureFixture[str]
) -> None:
    assert fault(base, *words) == 2
    told = capsys.readouterr()
    assert told.out == ""
    assert told.err.count("\n") == 1
    assert "this run has no twin" in told.err
    assert "vla-deploy run --twin" in told.err


def test_a_fault_is_sent_as_it_was_typed(
    base: Path, twin: Twin, capsys: pytest.CaptureFixture[str]
) -> None:
    twin.answer = {"ok": True, "injected": {"id": 4, "fault": "servo left_elbow: delayed"}}
    words = ("inject", "servo", "delayed", "left_elbow", "--start", "1", "--for", "2.5")
    assert fault(base, *words, "--set", "delay_s=0.02", "--seed", "7") == 0
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
    assert capsys.readouterr().out == "fault 4: servo left_elbow: delayed\n"


def test_the_twins_refusal_is_told_in_one_line(
    base: Path, twin: Twin, capsys: pytest.CaptureFixture[str]
) -> None:
    twin.answer = {"ok": False, "error": "servo: there is no fault 'echo' here"}
    assert fault(base, "inject", "servo", "echo") == 2
    assert capsys.readouterr().err == (
        "vla-deploy: the twin refuses: servo: there is no fault 'echo' here\n"
    )


def test_a_setting_without_a_number_is_refused(
    base: Path, twin: Twin, capsys: pytest.CaptureFixture[str]
) -> None:
    assert fault(base, "inject", "servo_bus", "brown_out", "--set", "volts=low") == 2
    assert "--set volts=low: expected NAME=NUMBER" in capsys.readouterr().err
    assert twin.asked == []


def test_clear_names_what_is_left(
    base: Path, twin: Twin, capsys: pytest.CaptureFixture[str]
) -> None:
    twin.answer = {"ok": True, "pending": [{"id": 2, "fault": "lidar: off", "on": True}]}
    assert fault(base, "clear", "1") == 0
    assert twin.asked == [{"op": "fault_clear", "id": 1}]
    assert capsys.readouterr().out == "fault 2: lidar: off (on)\n"


def test_list_prints_what_can_fail_with_its_parameters(
    base: Path, twin: Twin, capsys: pytest.CaptureFixture[str]
) -> None:
    parameter = {"name": "volts_v", "default": 4.0, "range": [0.0, 30.0], "meaning": "drop"}
    row = {"fault": "brown_out", "summary": "the supply sags", "parameters": [parameter]}
    twin.answer = {
        "ok": True,
        "catalogue": [{"component": "servo_bus", "instances": {}, "faults": [row]}],
        "scenarios": ["servo_off"],
        "pending": [],
    }
    assert fault(base, "list") == 0
    told = capsys.readouterr().out
    assert "brown_out         the supply sags; volts_v=4 (0..30)" in told
    assert "no fault is in force" in told
    assert fault(base, "list", "--json") == 0
    assert json.loads(capsys.readouterr().out)["scenarios"] == ["servo_off"]


def test_a_scenario_file_is_sent_as_text_and_its_cause_is_awaited(
    base: Path, twin: Twin, tmp_path: Path, capsys: pytest.CaptureFixture[str]
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
    assert fault(base, "run", str(path)) == 1
    assert twin.asked == [{"op": "fault_run", "name": "mine", "text": "summary = 'x'"}]
    assert "cause none, state silent; expected cause servo_bus_lost" in capsys.readouterr().err


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
    base: Path, twin: Twin, capsys: pytest.CaptureFixture[str], name: str, complaint: str
) -> None:
    (base / "noise.toml").write_bytes(b"\xfe\xff\x00")
    assert fault(base, "run", f"{base}/{name}") == 2
    error = capsys.readouterr().err
    assert complaint in error
    assert error.count("\n") == 1
    assert twin.asked == []


def test_a_robot_that_is_stopped_already_is_not_judged_by_that_cause(
    base: Path, twin: Twin, capsys: pytest.CaptureFixture[str]
) -> None:
    space = SharedSpace(base / "run" / "ipc", MonotonicClock())
    status = {"state": "stopped", "cause": "servo_bus_lost"}
    space.cell_writer("control_status").put_document(status)
    assert fault(base, "run", "servo_off") == 2
    space.close()
    assert "control is stopped already, cause servo_bus_lost" in capsys.readouterr().err
    assert twin.asked == []


@pytest.mark.parametrize("action", ["list", "inject", "clear", "run"])
def test_help_of_an_action_ends_with_an_example(
    action: str, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit):
        main(["fault", action, "--help"])
    assert f"examples:\n  vla-deploy fault {action}" in capsys.readouterr().out


def test_help_ends_with_examples(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        main(["fault", "--help"])
    assert "vla-deploy fault inject servo off left_elbow --for 2" in capsys.readouterr().out
