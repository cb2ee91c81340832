import json

import pytest

from benchmarks import control
from benchmarks.control import main
from vla_deploy.control.judging import safety_stage
from vla_deploy.safety import evaluate

STAGES = (
    *("read", "inputs", "contact", "clearance", "zones", "surroundings", "judge", "record"),
    *("plan", "limit", "wheels", "write", "tell", "rest"),
)


def test_the_report_shares_the_tick_out_to_its_parts(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["--json", "--seconds", "0.4"]) == 0
    report = json.loads(capsys.readouterr().out)
    assert report["ticks"] == pytest.approx(0.4 / report["period_s"], abs=1)
    shares = [report[f"{part}_ratio"] for part in STAGES]
    assert all(share > 0.0 for share in shares)
    assert report["total_ratio"] == pytest.approx(sum(shares))
    assert report["guarded_cost_ratio"] > 1.0
    assert safety_stage.evaluate is evaluate


def test_the_report_tells_the_stages_of_each_kind_of_tick(
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert main(["--json", "--seconds", "0.4"]) == 0
    columns = json.loads(capsys.readouterr().out)["ticks_us"]
    every = columns.pop("all")
    assert "idle" in columns
    assert every["ticks"] == sum(column["ticks"] for column in columns.values())
    for column in (every, *columns.values()):
        assert column["total"] == pytest.approx(sum(column[stage] for stage in STAGES))


def test_the_stages_are_printed_as_a_table(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["--seconds", "0.2"]) == 0
    table = capsys.readouterr().out.split("\n\n")[1].splitlines()
    assert table[0].split()[-1] == "all"
    assert [line.split()[0] for line in table[2:-1]] == [*control.STAGES]
