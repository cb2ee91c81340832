import json

import pytest

from benchmarks.control import main
from vla_deploy.control import judging
from vla_deploy.safety import evaluate

PARTS = ("read", "inputs", "surroundings", "record", "plan_and_limit", "write", "tell", "judge")


def test_the_report_shares_the_tick_out_to_its_parts(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["--json", "--seconds", "0.4"]) == 0
    report = json.loads(capsys.readouterr().out)
    assert report["ticks"] == pytest.approx(0.4 / report["period_s"], abs=1)
    shares = [report[f"{part}_ratio"] for part in (*PARTS, "rest")]
    assert all(share > 0.0 for share in shares)
    assert report["total_ratio"] == pytest.approx(sum(shares))
    assert report["guarded_cost_ratio"] > 1.0
    assert judging.evaluate is evaluate
