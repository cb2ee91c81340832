"""Write a crash report for each process that ended unexpectedly: one bounded JSON file each."""

import json
import logging
import signal
from collections.abc import Mapping, Sequence
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from drivers.clock import NS_PER_S, Clock
from vla_deploy.ipc import TOPICS, SharedSpace, TopicKind
from vla_deploy.runtime.logs import LOGS_DIR
from vla_deploy.supervisor.processes.lifecycle import RUNNING, ProcessRecord, ProcessState
from vla_deploy.supervisor.runs.log_files import BoundedFolder, as_line, last_output, read_log
from vla_deploy.supervisor.runs.options import RunOptions

KEEP = 50
LAST_LINES = 40
_TRACEBACK_LINES = 400  # the interpreter writes up to 100 frames of each thread
_TRACEBACK_STARTS = ("Fatal Python error", "Traceback (most recent call last)", "Current thread")
_ENDED = frozenset({ProcessState.BACKOFF, ProcessState.GIVEN_UP})
_log = logging.getLogger(__name__)


def crash_folder(state_dir: Path) -> BoundedFolder:
    """Return the folder with the newest crash reports of all runs."""
    return BoundedFolder(state_dir / "crashes", KEEP)


class CrashReports:
    """Report every process that failed, with its last log lines and the age of all topics."""

    def __init__(
        self,
        folder: BoundedFolder,
        run_dir: Path,
        options: RunOptions,
        space: SharedSpace,
        clock: Clock,
    ) -> None:
        self._folder = folder
        self._logs = run_dir / LOGS_DIR
        self._clock = clock
        self._head = {
            "run_id": run_dir.name,
            "robot": options.robot,
            "profile": options.profile,
            "twin": options.twin,
        }
        cells = [topic.name for topic in TOPICS if topic.kind is TopicKind.CELL]
        self._cells = {name: space.cell_reader(name) for name in cells}

    def note(
        self,
        before: Mapping[str, ProcessRecord],
        after: Mapping[str, ProcessRecord],
        started: Mapping[str, tuple[int, int]],
    ) -> None:
        """Write a report for each process that has just failed.

        `started` holds the pid of each process and when it was started; one that could not be
        started has no log lines.
        """
        for name, record in after.items():
            failed = before[name].state in RUNNING and record.state in _ENDED
            if failed and name in started:
                pid, started_ns = started[name]
                self._write(name, self._report(name, record, pid, started_ns))

    def _report(
        self, name: str, record: ProcessRecord, pid: int, started_ns: int
    ) -> dict[str, Any]:
        now_ns = self._clock.now_ns()
        lines = [line for line in read_log(self._logs, name) if line["pid"] == pid]
        output = last_output(self._logs, name, _TRACEBACK_LINES)
        return {
            "time": datetime.now(UTC).isoformat(timespec="milliseconds"),
            "stamp_ns": now_ns,
            "process": name,
            "pid": pid,
            **self._head,
            "exit_code": record.exit_code,
            "signal": signal_name(record.exit_code),
            "reason": record.reason,
            "given_up": record.state is ProcessState.GIVEN_UP,
            "uptime_s": round((now_ns - started_ns) / NS_PER_S, 3),
            "restarts": record.restarts,
            "traceback": traceback_of(lines, output),
            "last_log": [as_line(line) for line in lines[-LAST_LINES:]],
            "last_output": output[-LAST_LINES:],
            "topics": self._topics(now_ns),
        }

    def _topics(self, now_ns: int) -> dict[str, Any]:
        samples = {name: reader.latest() for name, reader in self._cells.items()}
        return {
            name: {
                "age_s": round(sample.age_s(now_ns), 4),
                "sequence": sample.sequence,
                "writer_pid": sample.writer_pid,
            }
            for name, sample in samples.items()
            if sample is not None
        }

    def _write(self, name: str, report: Mapping[str, Any]) -> None:
        try:
            path = self._folder.claim(f"{name}.json")
            _write_whole(path, json.dumps(report, indent=2) + "\n")
        except OSError as error:
            _log.warning("no crash report of %s: %s", name, error)
        else:
            _log.info("%s: crash report: vla-deploy crashes show %s", name, path.stem)


def _write_whole(path: Path, text: str) -> None:
    """Write a file whole or, as on a full disk, leave none.

    Raises:
        OSError: it cannot be written.
    """
    partial = path.with_name(f".{path.name}.part")
    try:
        partial.write_text(text, encoding="utf-8")
        partial.replace(path)
    except OSError:
        partial.unlink(missing_ok=True)
        raise


def signal_name(exit_code: int | None) -> str | None:
    """Return the name of the signal that ended a process, or None when it ended by itself."""
    if exit_code is None or exit_code >= 0:
        return None
    try:
        return signal.Signals(-exit_code).name
    except ValueError:
        return f"signal {-exit_code}"  # a real-time signal has no name


def traceback_of(lines: Sequence[Mapping[str, Any]], output: Sequence[str]) -> list[str]:
    """Return the traceback that was logged last, else the one the interpreter has written."""
    logged = [str(line["traceback"]) for line in lines if "traceback" in line]
    if logged:
        return logged[-1].splitlines()
    starts = [row for row, line in enumerate(output) if line.startswith(_TRACEBACK_STARTS)]
    return list(output[starts[0] :]) if starts else []
