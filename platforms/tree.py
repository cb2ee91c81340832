"""Read small system files below a root, and say why where that does not work.

A board lacks most of the files that another one has, some belong to root, some fail while a unit
sleeps, and some vanish between two reads. All of that is normal: one exception, `ValueMissing`,
says it.
"""

import os
from pathlib import Path
from typing import Final

_MOST_BYTES: Final = 262_144
_CHUNK_BYTES: Final = 32_768
_REASONS: Final = {
    FileNotFoundError: "there is no {path}",
    NotADirectoryError: "there is no {path}",
    PermissionError: "{path} may be read by root only",
    BlockingIOError: "{path} is asleep",
}


class ValueMissing(Exception):
    """Say why a number cannot be had; the caller turns it into a reading without a value."""


class SystemFile:
    """Read one file again and again by one handle."""

    __slots__ = ("_handle", "_path", "_shown")

    def __init__(self, root: Path, path: str) -> None:
        self._path = root / path.lstrip("/")
        self._shown = f"/{path.lstrip('/')}"
        self._handle: int | None = None

    def __str__(self) -> str:
        return self._shown

    def text(self) -> str:
        """Return the content without the white space and zeros around it.

        Raises:
            Missing: the file is not there, not readable, asleep, or not text.
        """
        try:
            return self._content().decode().strip(" \t\r\n\0")
        except OSError as error:
            self.close()
            raise ValueMissing(_reason(error, self._shown)) from error
        except UnicodeDecodeError as error:
            raise ValueMissing(f"{self._shown} is not text") from error

    def number(self) -> float:
        """Return the content as a number.

        Raises:
            Missing: as `text`, or the content is no finite number.
        """
        return number_in(self.text(), self._shown)

    def close(self) -> None:
        """Give the handle back; the next read opens another."""
        if self._handle is not None:
            os.close(self._handle)
            self._handle = None

    def _content(self) -> bytes:
        handle = self._opened()
        content = os.pread(handle, _CHUNK_BYTES, 0)
        while content and len(content) < _MOST_BYTES:
            more = os.pread(handle, _CHUNK_BYTES, len(content))
            if not more:
                break
            content += more
        return content

    def _opened(self) -> int:
        if self._handle is not None and not os.fstat(self._handle).st_nlink:
            self.close()  # replaced by another file of that name
        if self._handle is None:
            self._handle = os.open(self._path, os.O_RDONLY | os.O_CLOEXEC | os.O_NONBLOCK)
        return self._handle


class Tree:
    """Open files and list folders below a root: `/`, or a recorded tree."""

    def __init__(self, root: Path = Path("/")) -> None:
        self.root = root
        self._files: dict[str, SystemFile] = {}

    def file(self, path: str) -> SystemFile:
        """Return a file to be read repeatedly, whether it is there or not."""
        return self._files.setdefault(path, SystemFile(self.root, path))

    def close(self, below: str = "") -> None:
        """Give back the handles of all files, or of those below a folder."""
        for path in [path for path in self._files if path.startswith(below)]:
            self._files.pop(path).close()

    def text(self, path: str) -> str:
        """Return a file's content once.

        Raises:
            Missing: see `SystemFile.text`.
        """
        file = SystemFile(self.root, path)
        try:
            return file.text()
        finally:
            file.close()

    def number(self, path: str) -> float:
        """Return the number in a file once.

        Raises:
            Missing: see `SystemFile.number`.
        """
        return number_in(self.text(path), path)

    def names(self, folder: str) -> tuple[str, ...]:
        """Return what a folder holds, sorted; nothing where it cannot be listed."""
        try:
            with os.scandir(self.root / folder.lstrip("/")) as entries:
                return tuple(sorted(entry.name for entry in entries))
        except OSError:
            return ()

    def exists(self, path: str) -> bool:
        """Return whether the path is there, as far as that may be seen."""
        return os.access(self.root / path.lstrip("/"), os.F_OK)


def number_in(text: str, where: str) -> float:
    """Return the number that a text is.

    Raises:
        Missing: it is no finite number.
    """
    try:
        value = float(text)
    except ValueError as error:
        shown = f"holds {text[:24]!r}" if text else "is empty"
        raise ValueMissing(f"{where} {shown}, expected a number") from error
    if not abs(value) < float("inf"):
        raise ValueMissing(f"{where} holds {text[:24]!r}, expected a finite number")
    return value


def _reason(error: OSError, path: str) -> str:
    known = _REASONS.get(type(error))
    if known is not None:
        return known.format(path=path)
    return f"{path}: {error.strerror or error}"
