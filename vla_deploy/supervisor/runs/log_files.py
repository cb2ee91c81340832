"""Read the log files of a run, and keep logs and crash reports in bounded folders."""

import json
import logging
import os
import shutil
from collections import deque
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from vla_deploy.runtime.logs import LOGS_DIR

OUTPUT_SUFFIX = ".out"
"""What a process and its libraries write past the log: crashes of the interpreter, warnings."""
LOG_SUFFIX = ".log"
_OLDER_SUFFIX = ".log.1"
_BLOCK_BYTES = 65_536

LogLine = dict[str, Any]


def read_log(folder: Path, process: str) -> list[LogLine]:
    """Return the lines of a process, the oldest first; what is not whole is left out."""
    lines: list[LogLine] = []
    for suffix in (_OLDER_SUFFIX, LOG_SUFFIX):
        path = folder / f"{process}{suffix}"
        if path.is_file():
            text = path.read_text(encoding="utf-8", errors="replace")
            lines.extend(_parsed(text.splitlines()))
    return lines


def newest_lines(
    folder: Path, process: str, limit: int, least_level: int, before_ns: int | None = None
) -> list[LogLine]:
    """Return the newest lines of at least a level, the newest first; `before_ns` bounds stamps.

    The files are read from their ends, so that the newest lines of a long log cost little.
    """
    levels = logging.getLevelNamesMapping()
    found: list[LogLine] = []
    for suffix in (LOG_SUFFIX, _OLDER_SUFFIX):
        path = folder / f"{process}{suffix}"
        for line in _backwards(path) if path.is_file() else ():
            is_old = before_ns is None or int(line["stamp_ns"]) < before_ns
            if is_old and levels.get(str(line["level"]), logging.CRITICAL) >= least_level:
                found.append(line)
                if len(found) == limit:
                    return found
    return found


def _backwards(path: Path) -> Iterator[LogLine]:
    """Yield the lines of a file, the last first."""
    with path.open("rb") as log:
        offset, rest = log.seek(0, os.SEEK_END), b""
        while offset > 0:
            block = min(offset, _BLOCK_BYTES)
            offset -= block
            log.seek(offset)
            rest, *whole = (log.read(block) + rest).split(b"\n")
            yield from _parsed([line.decode(errors="replace") for line in reversed(whole)])
        yield from _parsed([rest.decode(errors="replace")])


def processes_in(folder: Path) -> list[str]:
    """Return the names of the processes that have logged."""
    names = {path.name.partition(".")[0] for path in folder.glob("*.log*")}
    return sorted(names | {path.stem for path in folder.glob(f"*{OUTPUT_SUFFIX}")})


def last_output(folder: Path, process: str, count: int) -> list[str]:
    """Return the last lines that a process has written past the log."""
    path = folder / f"{process}{OUTPUT_SUFFIX}"
    if not path.is_file():
        return []
    with path.open(encoding="utf-8", errors="replace") as output:
        return [line.rstrip() for line in deque(output, maxlen=count)]


def as_line(line: LogLine) -> str:
    """Return a line of the log for a person."""
    text = f"{line['time']} {line['process']}: {line['level']}: {line['message']}"
    return f"{text}\n{line['traceback']}" if "traceback" in line else text


class LogTail:
    """Follow the log of one process, across rotations."""

    def __init__(self, folder: Path, process: str) -> None:
        self._path = folder / f"{process}{LOG_SUFFIX}"
        self._inode = 0
        self._offset = 0

    def fresh(self) -> Iterator[LogLine]:
        """Yield the new lines that are whole; the first call yields all that the file holds."""
        if not self._path.is_file():
            return
        with self._path.open("rb") as log:
            inode = os.fstat(log.fileno()).st_ino
            if inode != self._inode:
                self._inode, self._offset = inode, 0
            log.seek(self._offset)
            whole, newline, _ = log.read().rpartition(b"\n")
        self._offset += len(whole) + len(newline)
        yield from _parsed(whole.decode(errors="replace").splitlines())


def _parsed(lines: list[str]) -> Iterator[LogLine]:
    for line in lines:
        try:
            parsed = json.loads(line)
        except json.JSONDecodeError:
            continue  # cut off by the end of its writer, or by a full disk
        if isinstance(parsed, dict) and "message" in parsed:
            yield parsed


LAST_LINES = 12


def last_words(run_dir: Path, process: str) -> list[str]:
    """Return the last lines of a process' log, then what it has written past it."""
    folder = run_dir / LOGS_DIR
    logged = [as_line(line) for line in read_log(folder, process)[-LAST_LINES:]]
    return [*logged, *last_output(folder, process, LAST_LINES)]


def complaint(run_dir: Path, process: str) -> str:
    """Return the last error of a process in one line, without its name; "" when there is none."""
    folder = run_dir / LOGS_DIR
    errors = [line["message"] for line in read_log(folder, process) if line["level"] == "ERROR"]
    if errors:
        return str(errors[-1])
    output = last_output(folder, process, 1)
    return output[-1].removeprefix(f"{process}: ") if output else ""


_DIGITS = 6


class BoundedFolder:
    """Number what it keeps, newest last, and remove the oldest beyond `keep`.

    Numbers, not times, say what is newer: a computer without a battery clock starts in the past.
    """

    def __init__(self, path: Path, keep: int) -> None:
        self.path = path
        self._keep = keep

    def entries(self) -> list[Path]:
        """Return what is kept, the oldest first."""
        return [path for _, path in sorted(self._numbered())]

    def claim(self, name: str) -> Path:
        """Return the path for the next entry, and make room for it.

        Raises:
            OSError: the folder cannot be written.
        """
        self.path.mkdir(mode=0o750, parents=True, exist_ok=True)
        numbered = sorted(self._numbered())
        for _, path in numbered[: max(0, len(numbered) - self._keep + 1)]:
            _remove(path)
        number = numbered[-1][0] + 1 if numbered else 1
        return self.path / f"{number:0{_DIGITS}d}-{name}"

    def _numbered(self) -> Iterator[tuple[int, Path]]:
        if not self.path.is_dir():
            return
        for path in self.path.iterdir():
            number = path.name.partition("-")[0]
            if number.isdecimal():
                yield int(number), path


def _remove(path: Path) -> None:
    if path.is_dir():
        shutil.rmtree(path, ignore_errors=True)
    else:
        path.unlink(missing_ok=True)
