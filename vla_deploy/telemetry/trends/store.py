"""Keep the history of every series in four levels of rings, each made from the finer one."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from vla_deploy.telemetry.errors import SeriesUnknown, TrendsUnavailable
from vla_deploy.telemetry.trends.ring_file import CELL, COLUMNS, RingFile, Row, SeriesColumns

_CATCH_UP: Final = 4
"""Coarser rows made at most at once, after a gap or a restart."""


@dataclass(frozen=True, slots=True, kw_only=True)
class TrendLevel:
    """Hold `span_s` in steps of `step_s`; a level that `outlives` a boot is on the disk."""

    name: str
    span_s: int
    step_s: int
    outlives: bool

    @property
    def rows(self) -> int:
        """Return how many steps are held."""
        return self.span_s // self.step_s

    def index(self, wall_s: float) -> int:
        """Return the number of the step that a moment lies in."""
        return int(wall_s // self.step_s)


LEVELS: Final[tuple[TrendLevel, ...]] = (
    TrendLevel(name="1min", span_s=60, step_s=1, outlives=False),
    TrendLevel(name="10min", span_s=600, step_s=5, outlives=False),
    TrendLevel(name="1h", span_s=3600, step_s=30, outlives=True),
    TrendLevel(name="24h", span_s=86400, step_s=600, outlives=True),
)
"""The finest first; each step is a multiple of the one before."""


def level_for(span_s: float) -> int:
    """Return the number of the finest level that covers a span."""
    return next(
        (number for number, level in enumerate(LEVELS) if span_s <= level.span_s), len(LEVELS) - 1
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class Trend:
    """Carry one series, the oldest first, NaN where nothing is known."""

    minimum: NDArray[np.float32]
    mean: NDArray[np.float32]
    maximum: NDArray[np.float32]


@dataclass(frozen=True, slots=True, kw_only=True)
class Trends:
    """Carry some series over one span in steps of `step_s`; `start_s` is wall clock."""

    start_s: int
    step_s: int
    series: Mapping[str, Trend]


class TrendStore:
    """Write one value of each series a second, and read them back at any level.

    `disk` holds what outlives a boot; `memory` is a folder in memory, to spare the disk.

    Raises:
        TrendsUnavailable: the files cannot be made.
    """

    def __init__(self, disk: Path, memory: Path) -> None:
        try:
            self._columns = SeriesColumns(disk)
        except OSError as error:
            raise TrendsUnavailable(
                f"{disk}: cannot keep the history: {error.strerror}; make room, or mend the folder"
            ) from error
        self._rings = [self._open(level, disk if level.outlives else memory) for level in LEVELS]
        self._made: list[int | None] = [None] * len(LEVELS)

    def write(self, wall_s: float, values: Mapping[str, float]) -> None:
        """Write the values of this second, and the coarser rows that are due.

        Raises:
            OSError: a new series has no place on the disk.
        """
        columns = self._columns.claim(sorted(values), wall_s, self._forget)
        row = np.zeros(COLUMNS, CELL)
        new = np.array([values[series] for series in sorted(values)], dtype=np.float32)
        for name in ("min", "mean", "max"):
            row[name][columns] = new
        row["weight"][columns] = np.isfinite(new)
        step = LEVELS[0].index(wall_s)
        before = self._rings[0].read(step)
        self._rings[0].write(step, row if before is None else _merged([before, row]))
        for number in range(1, len(LEVELS)):
            self._make(number, LEVELS[number].index(wall_s))

    def series(self) -> list[str]:
        """Return the names of all series."""
        return self._columns.names

    def read(self, names: list[str], number: int, wall_s: float, span_s: float) -> Trends:
        """Return series over the last `span_s`, at level `number`, up to the present step.

        Raises:
            SeriesUnknown: there is no series of that name.
        """
        columns = [self._column(name) for name in names]
        level = LEVELS[number]
        last = level.index(wall_s)
        count = min(level.rows, max(1, round(span_s / level.step_s)))
        table = np.zeros((count, len(columns)), CELL)
        for place, step in enumerate(range(last - count + 1, last + 1)):
            row = self._row(number, step)
            if row is not None:
                table[place] = row[columns]
        for field in ("min", "mean", "max"):
            table[field][table["weight"] == 0] = np.nan
        return Trends(
            start_s=(last - count + 1) * level.step_s,
            step_s=level.step_s,
            series={
                name: Trend(
                    minimum=table["min"][:, place],
                    mean=table["mean"][:, place],
                    maximum=table["max"][:, place],
                )
                for place, name in enumerate(names)
            },
        )

    def close(self) -> None:
        """Unmap the files; an unfinished step is made of the finer rows after the next start."""
        for ring in self._rings:
            ring.close()

    def _open(self, level: TrendLevel, folder: Path) -> RingFile:
        return RingFile(
            folder / f"{level.name}.ring",
            generation=self._columns.generation,
            rows=level.rows,
            columns=COLUMNS,
            step_s=level.step_s,
        )

    def _make(self, number: int, present: int) -> None:
        """Make the rows of the steps that have ended since the last one that was made."""
        made = self._made[number]
        if made is None or made >= present:  # the first time, or the clock was set back
            made = self._rings[number].newest(present - 1) or present - _CATCH_UP
        for step in range(max(made + 1, present - _CATCH_UP), present):
            row = self._of_finer(number, step)
            if row is not None:
                self._rings[number].write(step, row)
        self._made[number] = present - 1

    def _row(self, number: int, step: int) -> Row | None:
        row = self._rings[number].read(step)
        return row if row is not None or number == 0 else self._of_finer(number, step)

    def _of_finer(self, number: int, step: int) -> Row | None:
        """Return the row of a step, merged from the finer rows that exist."""
        ratio = LEVELS[number].step_s // LEVELS[number - 1].step_s
        finer = (self._row(number - 1, one) for one in range(step * ratio, (step + 1) * ratio))
        rows = [row for row in finer if row is not None]
        return _merged(rows) if rows else None

    def _forget(self, column: int) -> None:
        for ring in self._rings:
            ring.forget(column)

    def _column(self, series: str) -> int:
        column = self._columns.known(series)
        if column is None:
            raise SeriesUnknown(f"no series {series!r} is kept; GET /api/v1/history/series lists")
        return column


def _merged(rows: list[Row]) -> Row:
    table: NDArray[Any] = np.stack(rows)
    weight = table["weight"]
    there = weight > 0
    total = weight.sum(axis=0)
    merged = np.zeros(COLUMNS, CELL)
    merged["weight"] = total
    merged["min"] = np.where(there, table["min"], np.inf).min(axis=0)
    merged["max"] = np.where(there, table["max"], -np.inf).max(axis=0)
    weighted = np.where(there, table["mean"], 0.0) * weight
    merged["mean"] = weighted.sum(axis=0) / np.maximum(total, 1.0)
    merged[total == 0] = 0
    return merged
