import json
import resource

import pytest

from drivers.clock import NS_PER_S
from sim_twin.contracts.scripted import ManualClock
from vla_deploy.ipc import SharedSpace
from vla_deploy.supervisor.processes.crash_reports import CrashReports, signal_name, traceback_of
from vla_deploy.supervisor.processes.lifecycle import ProcessRecord, ProcessState
from vla_deploy.supervisor.runs.log_files import BoundedFolder
from vla_deploy.supervisor.runs.options import RunOptions

STARTED = {"planner": (42, 1 * NS_PER_S)}


@pytest.fixture
def folder(tmp_path):
    return BoundedFolder(tmp_path / "crashes", keep=2)


@pytest.fixture
def crashes(tmp_path, folder):
    run_dir = tmp_path / "run-1"
    (run_dir / "logs").mkdir(parents=True)
    clock = ManualClock(3 * NS_PER_S)
    space = SharedSpace(run_dir / "ipc", clock)
    space.cell_writer("base_state").commit()
    clock.ns += NS_PER_S // 2
    return CrashReports(folder, run_dir, RunOptions(), space, clock)


def end(crashes: CrashReports, before: ProcessState, after: ProcessState, **fields) -> None:
    crashes.note(
        {"planner": ProcessRecord(state=before)},
        {"planner": ProcessRecord(state=after, **fields)},
        STARTED,
    )


def test_a_report_tells_how_whom_and_how_old_the_topics_were(crashes, folder):
    end(
        crashes, ProcessState.READY, ProcessState.BACKOFF, exit_code=-9, reason="killed by signal 9"
    )
    (path,) = folder.entries()
    report = json.loads(path.read_text())
    assert path.name == "000001-planner.json"
    assert (report["process"], report["pid"], report["signal"]) == ("planner", 42, "SIGKILL")
    assert (report["run_id"], report["uptime_s"]) == ("run-1", 2.5)
    assert report["topics"]["base_state"]["age_s"] == 0.5
    assert "scene" not in report["topics"]


@pytest.mark.parametrize(
    ("before", "after"),
    [
        (ProcessState.READY, ProcessState.STOPPING),
        (ProcessState.STOPPING, ProcessState.STOPPED),
        (ProcessState.BACKOFF, ProcessState.STARTING),
        (ProcessState.GIVEN_UP, ProcessState.GIVEN_UP),
        (ProcessState.STOPPING, ProcessState.OFF),
    ],
)
def test_what_ends_as_asked_or_has_been_told_is_not_reported(crashes, folder, before, after):
    end(crashes, before, after, exit_code=0)
    assert folder.entries() == []


def test_old_reports_make_room(crashes, folder):
    for _ in range(4):
        end(crashes, ProcessState.READY, ProcessState.BACKOFF, exit_code=1)
    assert [path.name for path in folder.entries()] == [
        "000003-planner.json",
        "000004-planner.json",
    ]


def test_a_folder_that_cannot_be_written_is_told_and_stops_nobody(crashes, folder, caplog):
    folder.path.write_text("no folder")
    end(crashes, ProcessState.READY, ProcessState.BACKOFF, exit_code=1)
    assert "no crash report of planner" in caplog.text


def test_lines_of_an_earlier_instance_are_left_out(crashes, folder, tmp_path):
    log = tmp_path / "run-1" / "logs" / "planner.log"
    common = {"stamp_ns": 1, "time": "t", "level": "ERROR", "process": "planner"}
    lines = [{**common, "pid": pid, "message": f"of {pid}"} for pid in (41, 42)]
    log.write_text("".join(json.dumps(line) + "\n" for line in lines) + '{"cut off')
    end(crashes, ProcessState.READY, ProcessState.BACKOFF, exit_code=1)
    report = json.loads(folder.entries()[0].read_text())
    assert report["last_log"] == ["t planner: ERROR: of 42"]


def test_signals_have_names_and_other_ends_have_none():
    assert [signal_name(code) for code in (-9, -6, -45, 0, 2, None)] == [
        "SIGKILL",
        "SIGABRT",
        "signal 45",
        None,
        None,
        None,
    ]


def test_a_logged_traceback_goes_before_what_the_interpreter_wrote():
    output = ["warning", "Fatal Python error: Aborted", "", "Current thread", "  File x"]
    assert traceback_of([], output) == output[1:]
    assert traceback_of([{"traceback": "a\nb"}], output) == ["a", "b"]
    assert traceback_of([], ["nothing", "of note"]) == []


def test_a_report_that_does_not_fit_on_the_disk_leaves_no_broken_one(crashes, folder, caplog):
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (100, hard))
    try:
        end(crashes, ProcessState.READY, ProcessState.BACKOFF, exit_code=-9)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
    assert folder.entries() == []
    assert "no crash report of planner" in caplog.text
    end(crashes, ProcessState.READY, ProcessState.BACKOFF, exit_code=-9)
    assert len(folder.entries()) == 1
