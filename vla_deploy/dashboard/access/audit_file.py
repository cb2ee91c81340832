"""Append lines to a file that is set aside when it is full; only so many are kept."""

import json
import os
from collections.abc import Iterator, Mapping
from itertools import islice
from pathlib import Path
from typing import Any, Final

from vla_deploy.dashboard.access.errors import AuditUnusable
from vla_deploy.dashboard.access.private_file import open_private, turn

MOST_BYTES: Final = 2**20
MOST_FILES: Final = 5


class AuditFile:
    """Hold the audit log on disk: JSON lines, the newest last; several processes may append."""

    def __init__(
        self, path: Path, most_bytes: int = MOST_BYTES, most_files: int = MOST_FILES
    ) -> None:
        self.path = path
        self._most_bytes = most_bytes
        self._most_files = most_files

    def append(self, document: Mapping[str, Any]) -> None:
        """Write one line, in one piece.

        Raises:
            OSError: it cannot be written, such as for a full disk.
        """
        line = json.dumps(document, separators=(",", ":")).encode() + b"\n"
        with turn(self.path.with_suffix(".lock")):
            if self._size() + len(line) > self._most_bytes:
                self._set_aside()
            handle = open_private(self.path, os.O_WRONLY | os.O_APPEND)
            try:
                os.write(handle, line)
            finally:
                os.close(handle)

    def newest(self, count: int) -> list[dict[str, Any]]:
        """Return the last entries, the newest first.

        Raises:
            AuditUnusable: a file cannot be read.
        """
        try:
            return list(islice(self._backwards(), count))
        except OSError as error:
            raise AuditUnusable(
                f"{error.filename}: {error.strerror}; run as the robot's user, or as root"
            ) from error

    def _backwards(self) -> Iterator[dict[str, Any]]:
        for path in self._files():
            if not path.exists():
                continue
            for line in reversed(path.read_bytes().splitlines()):
                try:
                    entry = json.loads(line)
                except ValueError:
                    continue  # cut off by a full disk
                if isinstance(entry, dict):
                    yield entry

    def _files(self) -> list[Path]:
        older = [Path(f"{self.path}.{number}") for number in range(1, self._most_files)]
        return [self.path, *older]

    def _size(self) -> int:
        return self.path.stat().st_size if self.path.exists() else 0

    def _set_aside(self) -> None:
        files = self._files()
        for older, newer in zip(reversed(files[1:]), reversed(files[:-1]), strict=True):
            if newer.exists():
                newer.replace(older)
