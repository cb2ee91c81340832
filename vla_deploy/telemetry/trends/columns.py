"""Give every series a column of the ring files, and remember which."""

import json
import os
from collections.abc import Callable
from pathlib import Path
from typing import Final

COLUMNS: Final = 256
_FILE: Final = "columns.json"


class Columns:
    """Keep the names of the columns; a new series takes a free one, or that of the longest silent.

    The names and the rows belong together by `generation`: who loses one, loses the other.
    """

    def __init__(self, folder: Path, new_generation: Callable[[], int]) -> None:
        self._file = folder / _FILE
        self.generation, self._column_of = _read(self._file)
        if not self.generation:
            self.generation = new_generation()
            self._write()
        self._seen: dict[str, float] = dict.fromkeys(self._column_of, 0.0)

    def __len__(self) -> int:
        """Return how many columns are in use."""
        return len(self._column_of)

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
        """Replace the file as a whole: a kill leaves the old or the new one."""
        self._file.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
        part = self._file.with_suffix(".part")
        document = {"generation": self.generation, "columns": self._column_of}
        with part.open("w", encoding="utf-8") as file:
            json.dump(document, file)
            file.flush()
            os.fsync(file.fileno())
        part.replace(self._file)


def _read(file: Path) -> tuple[int, dict[str, int]]:
    """Return what was kept; nothing where the file is not there or not ours."""
    try:
        document = json.loads(file.read_text(encoding="utf-8"))
        generation, columns = int(document["generation"]), dict(document["columns"])
    except (FileNotFoundError, ValueError, KeyError, TypeError):
        return 0, {}
    given = list(columns.values())
    whole = all(type(number) is int and 0 <= number < COLUMNS for number in given)
    return (generation, columns) if whole and len(set(given)) == len(given) else (0, {})
