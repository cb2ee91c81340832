import json
import logging
import os
import socket
import subprocess
import sys
import threading
from pathlib import Path

import pytest

from drivers.clock import MonotonicClock
from vla_deploy.runtime import logs
from vla_deploy.runtime.journal import JournalHandler, encode, priority
from vla_deploy.runtime.logs import LogOrigin, RunLog, journal_stream

ORIGIN = LogOrigin(process="control", robot="butler", run_id="run-1")
log = logging.getLogger("vla_deploy.test_logs")


def lines(folder: Path) -> list[dict]:
    return [json.loads(line) for line in (folder / "control.log").read_text().splitlines()]


def decode(entry: bytes) -> dict[str, str]:
    """Read an entry as journald does."""
    fields = {}
    while entry:
        name, separator, rest = entry.partition(b"\n")
        if b"=" in name:
            key, _, value = name.partition(b"=")
            fields[key.decode()] = value.decode()
            entry = rest
            continue
        assert separator
        size = int.from_bytes(rest[:8], "little")
        fields[name.decode()] = rest[8 : 8 + size].decode()
        assert rest[8 + size : 9 + size] == b"\n"
        entry = rest[9 + size :]
    return fields


@pytest.fixture
def journal(tmp_path):
    listening = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
    listening.bind(str(tmp_path / "journal"))
    listening.settimeout(5)
    yield listening
    listening.close()


def test_a_line_carries_process_robot_run_and_place(tmp_path):
    with RunLog(ORIGIN, tmp_path, None, MonotonicClock()):
        log.warning("servo %d is hot", 3)
    (line,) = lines(tmp_path)
    assert line["message"] == "servo 3 is hot"
    assert (line["process"], line["robot"], line["run"]) == ("control", "butler", "run-1")
    assert (line["level"], line["pid"]) == ("WARNING", os.getpid())
    assert line["file"] == __file__
    assert line["stamp_ns"] > 0


def test_a_message_of_several_lines_and_a_traceback_stay_one_line_of_the_file(tmp_path):
    with RunLog(ORIGIN, tmp_path, None, MonotonicClock()):
        try:
            raise KeyError("elbow")
        except KeyError:
            log.exception("two\nlines")
    (line,) = lines(tmp_path)
    assert line["message"] == "two\nlines"
    assert line["traceback"].endswith("KeyError: 'elbow'")


def test_arguments_are_made_text_when_logged_since_they_may_change(tmp_path):
    state = ["armed"]
    with RunLog(ORIGIN, tmp_path, None, MonotonicClock()):
        log.info("state %s", state)
        state[0] = "stopped"
    assert lines(tmp_path)[0]["message"] == "state ['armed']"


def test_the_file_is_bounded_to_two_generations(tmp_path, monkeypatch):
    monkeypatch.setattr(logs, "GENERATION_BYTES", 20_000)
    with RunLog(ORIGIN, tmp_path, None, MonotonicClock()):
        for number in range(500):
            log.info("line %d", number)
    kept = sorted(path.name for path in tmp_path.iterdir())
    assert kept == ["control.log", "control.log.1"]
    assert all(path.stat().st_size <= 20_000 for path in tmp_path.iterdir())
    assert lines(tmp_path)[-1]["message"] == "line 499"


def hang_until(disk: threading.Event, monkeypatch: pytest.MonkeyPatch) -> None:
    emit = logs._LogFile.emit

    def slow(self: logs._LogFile, record: logging.LogRecord) -> None:
        disk.wait()
        emit(self, record)

    monkeypatch.setattr(logs._LogFile, "emit", slow)


def test_the_caller_does_not_wait_for_a_writer_that_hangs(tmp_path, monkeypatch):
    disk = threading.Event()
    hang_until(disk, monkeypatch)
    with RunLog(ORIGIN, tmp_path, None, MonotonicClock()):
        for number in range(2 * logs.QUEUE_LINES):
            log.info("line %d", number)
        disk.set()
    assert logs.QUEUE_LINES <= len(lines(tmp_path)) <= logs.QUEUE_LINES + 1


def test_what_a_full_queue_has_dropped_is_counted_in_the_next_line(tmp_path, monkeypatch):
    disk = threading.Event()
    hang_until(disk, monkeypatch)
    with RunLog(ORIGIN, tmp_path, None, MonotonicClock()) as run_log:
        for number in range(logs.QUEUE_LINES + 50):
            log.info("line %d", number)
        disk.set()
        while not run_log._queue.empty():
            pass
        log.info("after")
    assert lines(tmp_path)[-1]["message"].startswith("after (")
    assert lines(tmp_path)[-1]["message"].endswith("lines before this one were dropped)")


def test_a_full_disk_is_counted_and_raises_nothing(tmp_path, monkeypatch):
    class Full:
        def write(self, _text: str) -> None:
            raise OSError(28, "No space left on device")

    monkeypatch.setattr(logs._LogFile, "shouldRollover", lambda *_: False)
    run_log = RunLog(ORIGIN, tmp_path, None, MonotonicClock())
    (sink,) = run_log._sinks
    real, sink.stream = sink.stream, Full()
    with run_log:
        log.info("lost")
        while not run_log._queue.empty() or sink._refused == 0:
            pass
        sink.stream = real
        log.info("kept")
    (line,) = lines(tmp_path)
    assert (line["message"], line["refused_lines"]) == ("kept", 1)


def test_leaving_gives_the_root_logger_back(tmp_path):
    root = logging.getLogger()
    before = (root.level, list(root.handlers))
    with RunLog(ORIGIN, tmp_path, None, MonotonicClock()):
        assert len(root.handlers) == len(before[1]) + 1
    assert (root.level, root.handlers) == before


def test_the_journal_gets_one_entry_with_fields_that_can_be_searched(tmp_path, journal):
    with RunLog(ORIGIN, tmp_path / "logs", tmp_path / "journal", MonotonicClock()):
        log.error("servo 3: lost")
    entry = decode(journal.recv(65536))
    assert entry["MESSAGE"] == "servo 3: lost"
    assert entry["PRIORITY"] == "3"
    assert (entry["VLA_PROCESS"], entry["VLA_ROBOT"], entry["VLA_RUN"]) == (
        "control",
        "butler",
        "run-1",
    )
    assert entry["SYSLOG_IDENTIFIER"] == "vla-control"
    assert entry["CODE_FILE"] == __file__
    assert int(entry["CODE_LINE"]) > 0


def test_the_journal_gets_several_lines_whole(tmp_path, journal):
    with RunLog(ORIGIN, tmp_path / "logs", tmp_path / "journal", MonotonicClock()):
        log.info("one\ntwo = 2\n\nfour")
    assert decode(journal.recv(65536))["MESSAGE"] == "one\ntwo = 2\n\nfour"


def test_a_value_of_several_lines_is_preceded_by_its_length():
    assert encode({"MESSAGE": "a\nb", "X": "1"}) == (b"MESSAGE\n\x03\0\0\0\0\0\0\0a\nb\nX=1\n")


def test_levels_become_syslog_priorities():
    levels = (logging.CRITICAL, logging.ERROR, logging.WARNING, logging.INFO, logging.DEBUG)
    assert [priority(level) for level in levels] == [2, 3, 4, 6, 7]


def test_a_journal_that_is_away_is_counted_and_raises_nothing(tmp_path):
    handler = JournalHandler(tmp_path / "nobody", {})
    handler.emit(logging.makeLogRecord({"msg": "x", "levelno": logging.INFO}))
    assert handler.refused == 1
    handler.close()


def test_a_stream_is_the_journals_when_systemd_names_its_device_and_inode(tmp_path):
    with (tmp_path / "stream").open("w") as stream:
        status = os.fstat(stream.fileno())
        named = {"JOURNAL_STREAM": f"{status.st_dev}:{status.st_ino}"}
        assert journal_stream(named, stream.fileno())
        assert not journal_stream({"JOURNAL_STREAM": "1:2"}, stream.fileno())
        assert not journal_stream({}, stream.fileno())


SCRIPT = """
import logging, sys
from pathlib import Path
from drivers.clock import MonotonicClock
from vla_deploy.runtime.logs import process_log
with process_log("planner", "butler", Path(sys.argv[1]), MonotonicClock()):
    logging.getLogger("x").error("gone")
"""


@pytest.mark.parametrize(("run_id", "told"), [("run-1", ""), (None, "planner: ERROR: gone\n")])
def test_only_a_process_that_nobody_supervises_speaks_to_the_terminal(tmp_path, run_id, told):
    environment = {**os.environ} | ({"VLA_DEPLOY_RUN_ID": run_id} if run_id else {})
    done = subprocess.run(
        [sys.executable, "-c", SCRIPT, str(tmp_path)],
        env=environment,
        capture_output=True,
        text=True,
        check=True,
        timeout=30,
    )
    assert done.stderr == told
    assert json.loads((tmp_path / "logs" / "planner.log").read_text())["message"] == "gone"
