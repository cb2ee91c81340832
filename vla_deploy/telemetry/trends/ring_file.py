"""Keep rows of numbers in files of fixed size, so that a kill or a full disk spoils no other row.

A row belongs to the step of the wall clock that it stands for, at `step % rows`. It carries that
step and a CRC-32: what was cut off, or has another time, is not there. A clock that is set back
leaves rows of the future behind, which count as not there until they are overwritten.
"""

import json
import mmap
import os
import secrets
import struct
import zlib
from collections.abc import Callable
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

from vla_deploy.telemetry.errors import TrendsUnavailable

CELL: Final = np.dtype([("min", "<f4"), ("mean", "<f4"), ("max", "<f4"), ("weight", "<f4")])
"""One value of a step; a weight of 0 says that there is none."""

Row = NDArray[np.void]
COLUMNS: Final = 256
_COLUMNS_FILE: Final = "columns.json"
_MAGIC: Final = b"VLATREND"
_HEADER: Final = struct.Struct("<8sQIIII")  # magic, generation, rows, columns, step, version
_HEADER_BYTES: Final = 64
_ROW_HEAD: Final = struct.Struct("<qII")  # step, CRC-32, nothing
_VERSION: Final = 1


class RingFile:
    """Map one file of rows; rows of another generation or shape are discarded on opening.

    Raises:
        TrendsUnavailable: the file cannot be made, opened, or has no room.
    """

    def __init__(self, path: Path, *, generation: int, rows: int, columns: int, step_s: int):
        self.rows = rows
        self._columns = columns
        self._stride = _ROW_HEAD.size + columns * CELL.itemsize
        header = _HEADER.pack(_MAGIC, generation, rows, columns, step_s, _VERSION)
        size_bytes = _HEADER_BYTES + rows * self._stride
        try:
            self._memory = _map(path, header, size_bytes)
        except OSError as error:
            raise TrendsUnavailable(
                f"{path}: cannot keep the history: {error.strerror}; it needs {size_bytes} bytes"
            ) from error

    def write(self, step: int, row: Row) -> None:
        """Write the row of a step in the place of the oldest."""
        payload = row.tobytes()
        start = self._start(step)
        head = _ROW_HEAD.pack(step, _crc(step, payload), 0)
        self._memory[start : start + self._stride] = head + payload

    def read(self, step: int) -> Row | None:
        """Return the row of a step, or None where it is not there or not whole."""
        start = self._start(step)
        found, crc, _ = _ROW_HEAD.unpack_from(self._memory, start)
        if found != step:
            return None
        payload = self._memory[start + _ROW_HEAD.size : start + self._stride]
        if _crc(step, payload) != crc:
            return None
        return np.frombuffer(payload, CELL)

    def newest(self, limit: int) -> int | None:
        """Return the newest whole step that is not beyond `limit`."""
        starts = (_HEADER_BYTES + number * self._stride for number in range(self.rows))
        steps = (_ROW_HEAD.unpack_from(self._memory, start)[0] for start in starts)
        known = sorted((step for step in steps if 0 < step <= limit), reverse=True)
        return next((step for step in known if self.read(step) is not None), None)

    def forget(self, column: int) -> None:
        """Clear a column in every row, for another series."""
        for number in range(self.rows):
            step = _ROW_HEAD.unpack_from(self._memory, _HEADER_BYTES + number * self._stride)[0]
            row = self.read(step) if step > 0 else None
            if row is not None and row[column]["weight"]:
                cleared = row.copy()
                cleared[column] = 0
                self.write(step, cleared)

    def close(self) -> None:
        """Unmap the file; the kernel writes what is not yet on the disk."""
        self._memory.close()

    def _start(self, step: int) -> int:
        return _HEADER_BYTES + (step % self.rows) * self._stride


def _crc(step: int, payload: bytes) -> int:
    return zlib.crc32(payload, zlib.crc32(step.to_bytes(8, "little", signed=True)))


def _map(path: Path, header: bytes, size_bytes: int) -> mmap.mmap:
    path.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
    fd = os.open(path, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC | os.O_NOFOLLOW, 0o600)
    try:
        if os.pread(fd, len(header), 0) != header or os.fstat(fd).st_size != size_bytes:
            os.ftruncate(fd, 0)
            os.posix_fallocate(fd, 0, size_bytes)  # no SIGBUS when the disk is full later
            os.pwrite(fd, header, 0)
        return mmap.mmap(fd, size_bytes, access=mmap.ACCESS_WRITE)
    finally:
        os.close(fd)


class SeriesColumns:
    """Map series to columns; a new series takes a free one, or that of the longest silent.

    Names and rows belong together by `generation`: without the names, the rows are void.
    """

    def __init__(self, folder: Path) -> None:
        self._file = folder / _COLUMNS_FILE
        self.generation, self._column_of = _read_columns(self._file)
        if not self.generation:
            self.generation = secrets.randbits(63) | 1
            self._write()
        self._seen: dict[str, float] = dict.fromkeys(self._column_of, 0.0)

    @property
    def names(self) -> list[str]:
        """Return every series that has a column, by name."""
        return sorted(self._column_of)

    def known(self, series: str) -> int | None:
        """Return the column of a series that has one."""
        return self._column_of.get(series)

    def claim(self, wanted: list[str], wall_s: float, forget: Callable[[int], None]) -> list[int]:
        """Return a column for each series; `forget` empties one before another series gets it."""
        new = [series for series in wanted if series not in self._column_of]
        self._seen.update(dict.fromkeys(wanted, wall_s))
        for series in new:
            self._give(series, forget)
        if new:
            self._write()
        return [self._column_of[series] for series in wanted]

    def _give(self, series: str, forget: Callable[[int], None]) -> None:
        if len(self._column_of) < COLUMNS:
            taken = set(self._column_of.values())
            column = next(number for number in range(COLUMNS) if number not in taken)
        else:
            silent = min(self._column_of, key=lambda name: self._seen.get(name, 0.0))
            column = self._column_of.pop(silent)
            self._seen.pop(silent, None)
        forget(column)
        self._column_of[series] = column

    def _write(self) -> None:
        """Replace the file atomically."""
        self._file.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
        part = self._file.with_suffix(".part")
        document = {"generation": self.generation, "columns": self._column_of}
        with part.open("w", encoding="utf-8") as file:
            json.dump(document, file)
            file.flush()
            os.fsync(file.fileno())
        part.replace(self._file)


def _read_columns(file: Path) -> tuple[int, dict[str, int]]:
    """Return generation and columns; 0 and none where the file is missing or invalid."""
    try:
        document = json.loads(file.read_text(encoding="utf-8"))
        generation, columns = int(document["generation"]), dict(document["columns"])
    except (FileNotFoundError, ValueError, KeyError, TypeError):
        return 0, {}
    given = list(columns.values())
    whole = all(type(number) is int and 0 <= number < COLUMNS for number in given)
    return (generation, columns) if whole and len(set(given)) == len(given) else (0, {})
