import json

import pytest

from benchmarks.recorder import main


def test_the_report_holds_the_shares_of_the_tick_and_of_the_recorders_core(
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert main(["--json", "--seconds", "2"]) == 0
    report = json.loads(capsys.readouterr().out)
    assert report["ticks"] == pytest.approx(250, abs=1)
    assert 0.0 < report["tick_ratio_in_a_row"] < 1.0
    assert 0.0 < report["tick_ratio"] < 1.0
    assert 0.0 < report["look_core_ratio"] < report["write_core_ratio"]
    assert report["write_cpu_s"] > 0.0
    assert report["flight_bytes"] > 10_000
