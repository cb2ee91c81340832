"""The bus comparison runs against the emulated bus and prints what others rely on."""

import json

import pytest

from benchmarks.bus import main

pytestmark = pytest.mark.stack


def test_the_report_holds_the_ratio_and_every_client(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["--rounds", "1", "--seconds", "0.1", "--json"]) == 0
    report = json.loads(capsys.readouterr().out)
    assert 0.0 < report["cpu_ratio_vs_dynamixel_sdk"] < 1.0
    assert report["cycles_per_s"] > 0
    assert set(report["clients"]) == {
        "ours",
        "ours_fast",
        "dynamixel_sdk",
        "dynamixel_sdk_fast",
        "rustypot",
        "rustypot_fast",
    }
    for name in (
        "cpu_ratio_vs_rustypot",
        "core_share_1mbps_100hz",
        "cycle_time_ratio_vs_wire_limit",
        "reached_hz_1mbps",
        "reached_hz_3mbps",
    ):
        assert report[name] > 0.0
    assert report["clients"]["ours_fast"]["wire_bytes_per_cycle"] == 356


def test_feetech_servos_are_measured_beside_the_vendors_sdk(
    capsys: pytest.CaptureFixture[str],
) -> None:
    words = ["--family", "feetech", "--rounds", "1", "--seconds", "0.1", "--json"]
    assert main(words) == 0
    report = json.loads(capsys.readouterr().out)
    assert 0.0 < report["cpu_ratio_vs_scservo_sdk"] < 1.0
    assert report["cycle_time_ratio_vs_wire_limit"] > 1.0
    assert set(report["clients"]) == {"ours", "scservo_sdk", "rustypot"}
