"""Log lines come newest first, of one process or of all, page by page."""

import json

import pytest


@pytest.fixture
def logged(dashboard):
    folder = dashboard.link.run_dir / "logs"
    logs = (("control", 0, ("INFO", "WARNING")), ("planner", 1, ("INFO", "ERROR")))
    for process, shift, levels in logs:
        lines = [
            {"stamp_ns": 10 * number + shift, "level": level, "process": process}
            | {"message": f"{process} {number}"}
            for number, level in enumerate(levels)
        ]
        (folder / f"{process}.log").write_text("".join(json.dumps(one) + "\n" for one in lines))
    return dashboard


def messages(told):
    return [line["message"] for line in told["lines"]]


def test_all_processes_are_merged_by_time(logged):
    told = logged.get("logs")
    assert told["processes"] == ["control", "planner"]
    assert messages(told) == ["planner 1", "control 1", "planner 0", "control 0"]


def test_lines_are_chosen_by_process_level_and_time(logged):
    assert messages(logged.get("logs", process="planner", level="error")) == ["planner 1"]
    assert messages(logged.get("logs", process="control", before=10)) == ["control 0"]
    assert len(messages(logged.get("logs", limit=1))) == 1


def test_wishes_that_make_no_sense_are_refused(logged):
    assert "control, planner" in logged.get("logs", status=404, process="../x")["error"]["what"]
    logged.get("logs", status=422, limit=100_000)
    logged.get("logs", status=422, level="loud")
