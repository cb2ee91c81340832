"""A campaign's report must be read by people and by CI servers alike."""

import json
from pathlib import Path
from xml.etree import ElementTree

from sim_twin.campaigns.report import Case, Report

GOOD = Case(name="servo_bus/off/idle", figures={"rest_s": 0.5}, seconds=3.5)
BAD = Case(name="drive/stuck/driving", failures=("fall red_cup: 2, limit 1", "moved on"))
AGAIN = Case(name="control/SIGKILL", voids=("stood still for 0.031 s: late",))
SKIPPED = Case(name="disk_full", skipped="no small disk can be mounted")
REPORT = Report(
    campaign="faults", cases=(GOOD, BAD, AGAIN, SKIPPED), summary={"longest_rest_s": 0.5}
)


def test_the_document_counts_and_carries_every_case() -> None:
    document = json.loads(json.dumps(REPORT.document()))
    counts = [document[key] for key in ("cases", "failed", "skipped", "void_tries")]
    assert counts == [4, 1, 1, 1]
    names = [case.name for case in REPORT.cases]
    assert [result["name"] for result in document["results"]] == names
    assert document["results"][2]["voids"] == list(AGAIN.voids)
    assert document["longest_rest_s"] == 0.5


def test_the_text_shows_the_failed_cases_and_the_sum() -> None:
    text = REPORT.text()
    assert BAD.row in text
    assert GOOD.row not in text
    assert "void: control/SIGKILL: stood still for 0.031 s: late" in text
    assert "skipped: no small disk" in text
    assert text.endswith("faults: 4 cases, 1 failed, 1 skipped, 1 void tries")


def test_junit_names_cases_failures_and_time(tmp_path: Path) -> None:
    path = tmp_path / "out.xml"
    REPORT.write_junit(path)
    suite = ElementTree.parse(path).getroot()[0]
    assert suite.attrib == {
        "name": "faults",
        "tests": "4",
        "failures": "1",
        "errors": "0",
        "skipped": "1",
    }
    good, bad, again, skipped = suite.findall("testcase")
    assert good.get("time") == "3.500"
    assert [failure.get("message") for failure in bad.findall("failure")] == list(BAD.failures)
    assert good.find("failure") is None
    (rerun,) = again.findall("flakyFailure")
    assert rerun.get("message") == AGAIN.voids[0]
    (why,) = skipped.findall("skipped")
    assert why.get("message") == SKIPPED.skipped
