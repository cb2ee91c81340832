"""A campaign's report must be read by people and by CI servers alike."""

import json
from pathlib import Path
from xml.etree import ElementTree

import pytest

from sim_twin.campaigns.report import CampaignCase, CampaignReport, crash_is_failure

GOOD = CampaignCase(name="servo_bus/off/idle", figures={"rest_s": 0.5}, seconds=3.5)
BAD = CampaignCase(name="drive/stuck/driving", failures=("fall red_cup: 2, limit 1", "moved on"))
SKIPPED = CampaignCase(name="disk_full", skipped="no small disk can be mounted")
REPORT = CampaignReport(
    campaign="faults", cases=(GOOD, BAD, SKIPPED), summary={"longest_rest_s": 0.5}
)


def test_the_document_counts_and_carries_every_case() -> None:
    document = json.loads(json.dumps(REPORT.document()))
    assert [document[key] for key in ("cases", "failed", "skipped")] == [3, 1, 1]
    names = [case.name for case in REPORT.cases]
    assert [result["name"] for result in document["results"]] == names
    assert document["longest_rest_s"] == 0.5


def test_the_text_shows_the_failed_cases_and_the_sum() -> None:
    text = REPORT.text()
    assert BAD.row in text
    assert GOOD.row not in text
    assert "skipped: no small disk" in text
    assert text.endswith("faults: 3 cases, 1 failed, 1 skipped")


def test_junit_names_cases_failures_and_time(tmp_path: Path) -> None:
    path = tmp_path / "out.xml"
    REPORT.write_junit(path)
    suite = ElementTree.parse(path).getroot()[0]
    assert suite.attrib == {
        "name": "faults",
        "tests": "3",
        "failures": "1",
        "errors": "0",
        "skipped": "1",
    }
    good, bad, skipped = suite.findall("testcase")
    assert good.get("time") == "3.500"
    assert [failure.get("message") for failure in bad.findall("failure")] == list(BAD.failures)
    assert good.find("failure") is None
    (why,) = skipped.findall("skipped")
    assert why.get("message") == SKIPPED.skipped


@crash_is_failure
def _play(name: str, divisor: int) -> CampaignCase:
    return CampaignCase(name=name, figures={"share": 1 / divisor})


def test_what_a_case_raises_is_its_failure(capsys: pytest.CaptureFixture[str]) -> None:
    assert _play("whole", divisor=2).failures == ()
    broken = _play("broken", divisor=0)
    assert (broken.name, broken.failures) == (
        "broken",
        ("crashed: ZeroDivisionError: division by zero",),
    )
    assert "Traceback" in capsys.readouterr().err
