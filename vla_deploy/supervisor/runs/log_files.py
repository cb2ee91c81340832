"""Read the log files of a run, while it goes on or after its end."""

import json
import logging
import os
from collections import deque
from collections.abc import Iterator
from pathlib import Path
from typing import Any

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
    told = f"{line['time']} {line['process']}: {line['level']}: {line['message']}"
    return f"{told}\n{line['traceback']}" if "traceback" in line else told


class LogTail:
    """Return what one process has logged since the last look, across rotations."""

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
