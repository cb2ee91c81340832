"""Keep rows of numbers in a file of fixed size, so that a kill or a full disk spoils no other row.

A row belongs to the step of the wall clock that it stands for, at `step % rows`. It carries that
step and a CRC-32: what was cut off, or has another time, is not there. A clock that is set back
leaves rows of the future behind, which count as not there until they are overwritten.
"""

import mmap
import os
import struct
import zlib
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

from vla_deploy.telemetry.trends.errors import TrendsUnavailable

CELL: Final = np.dtype([("min", "<f4"), ("mean", "<f4"), ("max", "<f4"), ("weight", "<f4")])
"""One value of a step; a weight of 0 says that there is none."""

Row = NDArray[np.void]
_MAGIC: Final = b"VLATREND"
_HEADER: Final = struct.Struct("<8sQIIII")  # magic, generation, rows, columns, step, version
_HEADER_BYTES: Final = 64
_ROW_HEAD: Final = struct.Struct("<qII")  # step, CRC-32, nothing
_VERSION: Final = 1


class RingFile:
    """Map one file of rows; rows of another generation or shape are let go when it is opened.

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
        """Put the row of a step in the place of the oldest."""
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
        """Take a column out of every row, for another series."""
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
