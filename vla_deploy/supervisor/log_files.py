"""Read the log files of a run, while it goes on or after its end."""

import json
import os
from collections import deque
from collections.abc import Iterator
from pathlib import Path
from typing import Any

OUTPUT_SUFFIX = ".out"
"""What a process and its libraries write past the log: crashes of the interpreter, warnings."""
LOG_SUFFIX = ".log"
_OLDER_SUFFIX = ".log.1"

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
