"""Log to the run's folder and, as a systemd service, to the journal; the caller never waits.

A line is put into a queue, a thread of its own writes it: control is not held up by a slow disk.
What a full queue refuses is counted and told. The folder holds one JSON object per line and
process, in two generations of bounded size.
"""

import json
import logging
import logging.handlers
import os
import sys
import traceback
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from queue import SimpleQueue
from types import TracebackType
from typing import Any, TextIO

from drivers.clock import Clock
from vla_deploy.runtime.journal import JOURNAL_SOCKET, JournalHandler

RUN_ID_VARIABLE = "VLA_DEPLOY_RUN_ID"
"""Every process of a run carries the run's id in its environment, by which it is found again."""
LOGS_DIR = "logs"
GENERATION_BYTES = 1_000_000
QUEUE_LINES = 2000


@dataclass(frozen=True, slots=True, kw_only=True)
class LogOrigin:
    """Say who logs: every line carries it."""

    process: str
    robot: str
    run_id: str

    def journal_fields(self) -> Mapping[str, str]:
        """Return the journal's fields by which lines are found: journalctl VLA_PROCESS=control."""
        return {
            "SYSLOG_IDENTIFIER": f"vla-{self.process}",
            "VLA_PROCESS": self.process,
            "VLA_ROBOT": self.robot,
            "VLA_RUN": self.run_id,
        }


class RunLog:
    """Send all that this process logs to its file, and to the journal where there is one.

    Use it as a context manager; leaving it writes what is still queued.
    """

    def __init__(
        self,
        origin: LogOrigin,
        folder: Path,
        journal: Path | None,
        clock: Clock,
    ) -> None:
        folder.mkdir(parents=True, exist_ok=True)
        self._root = logging.getLogger()
        self._level = self._root.level
        sinks: list[logging.Handler] = [_LogFile(folder / f"{origin.process}.log", origin)]
        if journal is not None:
            sinks.append(JournalHandler(journal, origin.journal_fields()))
        self._sinks = sinks
        self._queue: SimpleQueue[Any] = SimpleQueue()
        self._handler = _NeverWaiting(self._queue, clock)
        self._listener = logging.handlers.QueueListener(self._queue, *sinks)

    def __enter__(self) -> "RunLog":
        self._root.addHandler(self._handler)
        self._root.setLevel(logging.INFO)
        self._listener.start()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        where: TracebackType | None,
    ) -> None:
        self.close()

    def close(self) -> None:
        """Write what is queued and let the logging module be as before."""
        self._root.removeHandler(self._handler)
        self._root.setLevel(self._level)
        self._listener.stop()
        for sink in self._sinks:
            sink.close()


class _NeverWaiting(logging.handlers.QueueHandler):
    """Queue records, made into text here: what they refer to may change; drop what is too much."""

    queue: SimpleQueue[Any]

    def __init__(self, lines: SimpleQueue[Any], clock: Clock) -> None:
        super().__init__(lines)
        self._clock = clock
        self._dropped = 0

    def prepare(self, record: logging.LogRecord) -> logging.LogRecord:
        record.stamp_ns = self._clock.now_ns()
        record.msg, record.args = record.getMessage(), None
        if record.exc_info and record.exc_info[1] is not None:
            record.exc_text = "".join(traceback.format_exception(record.exc_info[1])).rstrip()
        record.exc_info = None
        return record

    def enqueue(self, record: logging.LogRecord) -> None:
        if self.queue.qsize() >= QUEUE_LINES:
            self._dropped += 1
            return
        if self._dropped:
            record.msg = f"{record.msg} ({self._dropped} lines before this one were dropped)"
            self._dropped = 0
        self.queue.put_nowait(record)


class _LogFile(logging.handlers.RotatingFileHandler):
    """Write JSON lines; what a full disk refuses is counted in the next line that fits."""

    def __init__(self, path: Path, origin: LogOrigin) -> None:
        super().__init__(path, maxBytes=GENERATION_BYTES, backupCount=1, encoding="utf-8")
        self._origin = origin
        self._refused = 0

    def format(self, record: logging.LogRecord) -> str:
        line = json_record(record, self._origin)
        if self._refused:
            line["refused_lines"] = self._refused
        return json.dumps(line, ensure_ascii=False)

    def handleError(self, record: logging.LogRecord) -> None:  # noqa: N802 - logging's name
        self._refused += 1


def json_record(record: logging.LogRecord, origin: LogOrigin) -> dict[str, Any]:
    """Return a record as the fields of one JSON line: `stamp_ns` orders, `time` is for people."""
    line = {
        "stamp_ns": vars(record).get("stamp_ns", 0),
        "time": datetime.fromtimestamp(record.created, UTC).isoformat(timespec="milliseconds"),
        "level": record.levelname,
        "process": origin.process,
        "pid": record.process,
        "robot": origin.robot,
        "run": origin.run_id,
        "logger": record.name,
        "message": record.getMessage(),
        "file": record.pathname,
        "line": record.lineno,
    }
    return line | ({"traceback": record.exc_text} if record.exc_text else {})


@contextmanager
def process_log(process: str, robot: str, run_dir: Path, clock: Clock) -> Iterator[None]:
    """Log to the run's folder; to the journal or the terminal where these listen.

    Only a process that nobody supervises speaks to the terminal: a supervised one has none.
    """
    root = logging.getLogger()
    supervised = RUN_ID_VARIABLE in os.environ
    origin = LogOrigin(process=process, robot=robot, run_id=run_dir.resolve().name)
    journal = JOURNAL_SOCKET if supervised and "JOURNAL_STREAM" in os.environ else None
    console = None if supervised else console_handler(sys.stderr, process)
    if console:
        root.addHandler(console)
    try:
        with RunLog(origin, run_dir / LOGS_DIR, journal, clock):
            yield
    finally:
        if console:
            root.removeHandler(console)


def console_handler(stream: TextIO, process: str) -> logging.Handler:
    """Return a handler that writes for a person: one line, the process' name in front."""
    handler = logging.StreamHandler(stream)
    handler.setFormatter(logging.Formatter(f"{process}: %(levelname)s: %(message)s"))
    return handler


def journal_stream(environment: Mapping[str, str], fd: int) -> bool:
    """Return whether `fd` leads to the journal: systemd then names its device and inode."""
    try:
        status = os.fstat(fd)
    except OSError:
        return False
    return environment.get("JOURNAL_STREAM") == f"{status.st_dev}:{status.st_ino}"
