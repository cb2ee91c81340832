"""`vla-deploy logs` and `vla-deploy crashes` on files as a run leaves them."""

import json
import threading
from pathlib import Path

import pytest


def line(process: str, stamp_ns: int, level: str = "INFO", **more: object) -> str:
    told = {
        "stamp_ns": stamp_ns,
        "time": f"t{stamp_ns}",
        "level": level,
        "process": process,
        "pid": 1,
        "message": f"{process} {stamp_ns}",
    }
    return json.dumps(told | more) + "\n"


@pytest.fixture
def logs(run_dir: Path) -> Path:
    """Return the logs of a robot that runs and has logged."""
    logs = run_dir / "logs"
    logs.mkdir()
    (logs / "control.log.1").write_text(line("control", 1))
    (logs / "control.log").write_text(line("control", 3, "WARNING") + line("control", 5)[:20])
    (logs / "planner.log").write_text(line("planner", 2, "ERROR", traceback="Traceback\nKeyError"))
    (logs / "planner.out").write_text("a library's warning\n")
    return logs


@pytest.fixture
def run(vla):
    """Run one command line; return its exit code, its lines and its errors."""

    def run(*words: str) -> tuple[int, list[str], str]:
        code, out, err = vla(*words)
        return code, out.splitlines(), err

    return run


def test_all_processes_are_shown_in_order_of_time(run, logs):
    assert run("logs")[1] == [
        "t1 control: INFO: control 1",
        "t2 planner: ERROR: planner 2",
        "Traceback",
        "KeyError",
        "t3 control: WARNING: control 3",
    ]


def test_one_process_is_shown_with_what_it_wrote_past_its_log(run, logs):
    assert run("logs", "planner")[1][3:] == [
        "--- what planner has written past its log ---",
        "a library's warning",
    ]


def test_a_level_leaves_out_what_is_below(run, logs):
    told = run("logs", "--level", "warning", "--json")[1]
    assert [json.loads(one)["level"] for one in told] == ["ERROR", "WARNING"]


def test_an_unknown_process_is_refused_with_those_that_logged(run, logs):
    code, _, error = run("logs", "dashboard")
    assert code == 2
    assert "no log of 'dashboard'" in error
    assert error.endswith("there are control, planner\n")


def test_the_run_that_ended_last_is_shown(run, base):
    for name in ("000009-b", "000010-a"):
        folder = base.with_name("base-state") / "runs" / name
        folder.mkdir(parents=True)
        (folder / "control.log").write_text(line("control", int(name[:6])))
    assert run("logs", "--last-run")[1] == ["t10 control: INFO: control 10"]


def test_following_an_ended_run_is_refused(run, logs):
    assert run("logs", "--follow", "--last-run")[0] == 2


def test_following_shows_what_comes_later_and_ends_with_the_run(run, logs, base):
    log = logs / "control.log"
    log.write_text(line("control", 3))

    def go_on() -> None:
        with log.open("a") as file:
            file.write(line("control", 4))
        log.rename(log.with_name("control.log.1"))
        log.write_text(line("control", 5))
        (base / "lock").write_text("")

    later = threading.Timer(0.5, go_on)
    later.start()
    told = run("logs", "control", "--follow")[1]
    later.join()
    assert told[0] == "t3 control: INFO: control 3"
    assert told[-1] == "t5 control: INFO: control 5"


REPORT = {
    "time": "2026-01-01T00:00:00+00:00",
    "process": "planner",
    "pid": 42,
    "run_id": "run-1",
    "robot": "butler",
    "profile": "desktop",
    "exit_code": -6,
    "signal": "SIGABRT",
    "reason": "planner_status silent for 5.1 s, limit 5 s",
    "uptime_s": 12.5,
    "restarts": 1,
    "traceback": ["Fatal Python error: Aborted", "  File x"],
    "last_log": ["t planner: INFO: x"],
    "last_output": [],
    "topics": {"scene": {"age_s": 0.2}},
}


@pytest.fixture
def crashed(base: Path) -> Path:
    """Return the folder of two crash reports."""
    folder = base.with_name("base-state") / "crashes"
    folder.mkdir(parents=True)
    for name, pid in (("000001-planner", 41), ("000002-planner", 42)):
        (folder / f"{name}.json").write_text(json.dumps({**REPORT, "pid": pid}))
    return folder


def test_crashes_are_listed_the_newest_last(run, crashed):
    told = run("crashes", "list")[1]
    assert [one.split()[0] for one in told] == ["000001-planner", "000002-planner"]
    assert told[0].endswith("planner_status silent for 5.1 s, limit 5 s")
    told = json.loads("\n".join(run("crashes", "list", "--json")[1]))
    assert [one["pid"] for one in told] == [41, 42]


def test_the_newest_crash_is_shown_unless_one_is_named(run, crashed):
    assert run("crashes", "show")[1][0].startswith("planner (pid 42): ")
    told = run("crashes", "show", "000001-planner")[1]
    assert told[0].startswith("planner (pid 41): ")
    assert "  File x" in told
    assert "  scene: 0.2 s" in told
    shown = json.loads("\n".join(run("crashes", "show", "--json")[1]))
    assert shown["pid"] == 42


def test_a_crash_report_that_was_cut_off_hides_no_other_one(run, crashed):
    (crashed / "000009-speech.json").write_text('{"time": "2026')
    code, told, _ = run("crashes", "list")
    rows = json.loads("\n".join(run("crashes", "list", "--json")[1]))
    assert (code, len(told)) == (0, len(rows))
    assert told[-1].startswith("000009-speech ")
    assert "not whole" in told[-1]
    assert [("unreadable" in row) for row in rows] == [False] * (len(rows) - 1) + [True]


def test_an_unknown_crash_is_refused(run, crashed):
    code, _, error = run("crashes", "show", "7")
    assert (code, error) == (
        2,
        "vla-deploy: no crash report '7'; see: vla-deploy crashes list\n",
    )


def test_no_crash_is_told_as_such(run, logs):
    assert run("crashes", "list")[:2] == (0, ["no process has crashed"])
    assert run("crashes", "show")[0] == 2
