import json

import pytest

from benchmarks.twin import main


def test_the_report_holds_the_ratio_and_the_real_time_factor(
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert main(["--json", "--rounds", "1", "--steps", "50"]) == 0
    report = json.loads(capsys.readouterr().out)
    assert 0.0 < report["step_rate_ratio_vs_raw"] < 1.0
    assert 0.0 < report["mj_step_cpu_ratio_with_answers"] < report["mj_step_cpu_ratio"] < 1.0
    assert report["twin_real_time_factor"] > report["real_time_factor"] > 0.0
    assert report["control_real_time_factor"] > 0.0


def test_the_text_names_all_runs(capsys: pytest.CaptureFixture[str]) -> None:
    main(["--rounds", "1", "--steps", "50"])
    lines = capsys.readouterr().out.splitlines()
    assert [line.split("  ")[0] for line in lines] == [
        "raw mj_step",
        "twin",
        "lock-step + drivers",
        "lock-step + control",
    ]
