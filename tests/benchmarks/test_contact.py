import json

import pytest

from benchmarks.contact import main

pytestmark = [pytest.mark.gl, pytest.mark.timeout(120)]


def test_each_judged_joint_is_told_with_its_limit(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["--json", "--job", "go to the attic", "--job", "look left"]) == 1
    report = json.loads(capsys.readouterr().out)
    assert [job["success"] for job in report["jobs"]] == [False, True]
    row = report["joints"]["left_shoulder_pitch"]
    assert 0.0 <= row["p50_nm"] <= row["p99_nm"] <= row["max_nm"] < row["limit_nm"]
    assert "left_gripper" not in report["joints"], "its servo measures no current"
