import json

import pytest

from benchmarks.command import parser, show


def test_every_benchmark_has_a_help_text_with_an_example(
    capsys: pytest.CaptureFixture[str],
) -> None:
    with pytest.raises(SystemExit) as ended:
        parser("kettle", "Measure the kettle.").parse_args(["--help"])
    assert ended.value.code == 0
    told = capsys.readouterr().out
    assert "Measure the kettle." in told
    assert "vla-deploy bench kettle --json" in told


def test_what_vla_deploy_bench_does_not_list_is_started_as_a_module() -> None:
    told = parser("kettle_lid", "Measure the lid.").format_help()
    assert "  python -m benchmarks.kettle_lid --json" in told


def test_a_report_is_json_or_a_line_per_figure(capsys: pytest.CaptureFixture[str]) -> None:
    report = {"cycles": 3, "boil_ratio": 0.123456789, "missing": None}
    show(report, as_json=True)
    assert json.loads(capsys.readouterr().out) == report
    show(report, as_json=False)
    assert capsys.readouterr().out.splitlines() == [
        "cycles     3",
        "boil_ratio 0.123457",
        "missing    None",
    ]


def test_a_benchmark_may_have_a_text_of_its_own(capsys: pytest.CaptureFixture[str]) -> None:
    show({"cups": 2}, as_json=False, text=lambda report: f"{report['cups']} cups")
    assert capsys.readouterr().out == "2 cups\n"
