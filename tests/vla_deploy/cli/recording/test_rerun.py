"""Ask for files of Rerun's on the command line."""

import sys
from pathlib import Path

import pytest

from vla_deploy.cli.main import main

FLIGHT = Path(__file__).parents[2] / "telemetry" / "flights" / "estop_while_driving.mcap"


def test_without_the_extra_one_line_tells_how_to_get_it(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    monkeypatch.setitem(sys.modules, "rerun", None)
    assert main(["rerun", str(FLIGHT), "--save", str(tmp_path / "out.rrd")]) == 2
    told = capsys.readouterr().err
    assert told.count("\n") == 1
    assert "pip install 'vla-deploy[rerun]'" in told


def test_a_flight_becomes_a_file(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    pytest.importorskip("rerun", reason="the extra [rerun] is not installed")
    out = tmp_path / "out.rrd"
    assert main(["rerun", str(FLIGHT), "--save", str(out)]) == 0
    assert out.stat().st_size > 10_000
    told = capsys.readouterr().out
    assert told.startswith(f"{FLIGHT.name}: 465 messages: ")
    assert "left out" not in told
