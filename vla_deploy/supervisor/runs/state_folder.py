"""Keep what outlives a run - logs, crash reports - in bounded folders."""

import shutil
from collections.abc import Iterator
from pathlib import Path

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
        self.path.mkdir(mode=0o755, parents=True, exist_ok=True)
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
