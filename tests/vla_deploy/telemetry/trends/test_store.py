"""The history keeps least, mean and most, bounded, over restarts, kills and clocks set anew."""

from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest

from vla_deploy.telemetry.errors import SeriesUnknown, TrendsUnavailable
from vla_deploy.telemetry.trends import LEVELS, TrendStore
from vla_deploy.telemetry.trends.ring_file import COLUMNS

START_S = 1_800_000_000  # a whole number of steps of every level
Open = Callable[[], TrendStore]


@pytest.fixture
def open_store(tmp_path: Path) -> Iterator[Open]:
    opened = []

    def open_one() -> TrendStore:
        opened.append(TrendStore(tmp_path / "disk", tmp_path / "memory"))
        return opened[-1]

    yield open_one
    for store in opened:
        store.close()


def fill(store: TrendStore, seconds: int, start_s: int = START_S) -> None:
    for second in range(seconds):
        store.write(start_s + second + 0.3, {"a": float(second), "b/x": 1.0})


def mean(store: TrendStore, level: int, wall_s: float, span_s: float = 1e9) -> list[float]:
    told: list[float] = store.read(["a"], level, wall_s, span_s).series["a"].mean.tolist()
    return told


def test_each_level_has_least_mean_and_most_of_its_steps(open_store: Open) -> None:
    store = open_store()
    fill(store, 1205)
    now_s = START_S + 1204.5
    assert mean(store, 0, now_s)[-3:] == [1202.0, 1203.0, 1204.0]
    trend = store.read(["a"], 2, now_s, 3600).series["a"]
    assert trend.mean[-2:].tolist() == [1184.5, 1202.0]
    assert (trend.minimum[-2], trend.maximum[-2]) == (1170.0, 1199.0)
    assert mean(store, 3, now_s)[-3:] == [299.5, 899.5, 1202.0]


def test_what_was_not_written_is_unknown_and_not_zero(open_store: Open) -> None:
    store = open_store()
    fill(store, 3)
    store.write(START_S + 10, {"a": 7.0})
    assert mean(store, 0, START_S + 10, 5)[-1] == 7.0
    assert np.isnan(mean(store, 0, START_S + 10, 5)[:-1]).all()
    assert np.isnan(store.read(["b/x"], 0, START_S + 10, 1).series["b/x"].mean).all()


def test_a_store_that_was_never_closed_goes_on_where_it_was_killed(open_store: Open) -> None:
    fill(open_store(), 700)
    store = open_store()
    fill(store, 10, START_S + 700)
    assert mean(store, 0, START_S + 709, 12) == [698.0, 699.0, *range(10)]
    assert mean(store, 3, START_S + 709)[-2] == 299.5


def test_a_row_that_was_cut_off_is_not_there_and_spoils_no_other(
    open_store: Open, tmp_path: Path
) -> None:
    fill(open_store(), 60)
    file = tmp_path / "memory" / "1min.ring"
    spoiled = bytearray(file.read_bytes())
    row_bytes = (len(spoiled) - 64) // LEVELS[0].rows
    place = 64 + (START_S + 30) % LEVELS[0].rows * row_bytes
    spoiled[place + 100 : place + 200] = b"\xff" * 100
    file.write_bytes(spoiled)
    told = mean(open_store(), 0, START_S + 59)
    assert np.flatnonzero(np.isnan(told)).tolist() == [30]


def test_files_do_not_grow_and_the_boot_takes_only_what_is_fine(
    open_store: Open, tmp_path: Path
) -> None:
    fill(open_store(), 5)
    sizes = {path.name: path.stat().st_size for path in tmp_path.rglob("*.ring")}
    fill(open_store(), 700, START_S + 5)
    assert {path.name: path.stat().st_size for path in tmp_path.rglob("*.ring")} == sizes
    assert sum(sizes.values()) < 2_000_000
    for path in (tmp_path / "memory").iterdir():
        path.unlink()
    store = open_store()
    assert np.isnan(mean(store, 0, START_S + 704)).all()
    assert mean(store, 2, START_S + 704)[-3:-1] == [640 - 0.5, 670 - 0.5]


def test_a_clock_that_is_set_back_hides_the_future_and_goes_on(open_store: Open) -> None:
    store = open_store()
    fill(store, 100)
    fill(store, 40, START_S - 5000)
    now_s = START_S - 5000 + 39
    assert mean(store, 0, now_s)[-40:] == list(range(40))
    assert mean(store, 1, now_s)[-3:] == [27.0, 32.0, 37.0]
    fill(store, 30, START_S + 100_000)  # and is put right by more than all levels
    assert mean(store, 0, START_S + 100_029)[-30:] == list(range(30))
    assert np.isnan(mean(store, 3, START_S + 100_029)[:-1]).all()


def test_a_new_series_takes_the_column_of_the_longest_silent_and_not_its_past(
    open_store: Open,
) -> None:
    store = open_store()
    store.write(START_S, {"old": 5.0})
    store.write(START_S + 1, {f"s{number}": 1.0 for number in range(COLUMNS - 1)})
    store.write(START_S + 2, {"new": 2.0})
    assert "old" not in store.series()
    told = store.read(["new"], 0, START_S + 2, 3).series["new"].mean
    assert told[-1] == 2.0
    assert np.isnan(told[:-1]).all()
    with pytest.raises(SeriesUnknown, match="'old'"):
        store.read(["old"], 0, START_S, 10)


@pytest.mark.parametrize("content", ["", "{", '{"generation": 1, "columns": {"a": 999}}'])
def test_names_that_cannot_be_read_take_their_rows_with_them(
    open_store: Open, tmp_path: Path, content: str
) -> None:
    fill(open_store(), 10)
    (tmp_path / "disk" / "columns.json").write_text(content)
    store = open_store()
    assert store.series() == []
    store.write(START_S + 10, {"a": 3.0})
    assert np.isnan(mean(store, 0, START_S + 10, 5)[:-1]).all()


def test_a_folder_that_cannot_be_made_is_told_with_the_reason(tmp_path: Path) -> None:
    (tmp_path / "disk").write_text("no folder")
    with pytest.raises(TrendsUnavailable, match="disk"):
        TrendStore(tmp_path / "disk", tmp_path / "memory")
