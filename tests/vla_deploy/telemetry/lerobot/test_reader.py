"""Datasets that are not whole are refused by name, whatever is wrong with them."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from vla_deploy.telemetry.errors import DatasetUnusable
from vla_deploy.telemetry.lerobot.reader import LeRobotDataset
from vla_deploy.telemetry.lerobot.writer import DatasetWriter

pytestmark = pytest.mark.usefixtures("needs_arrow")
INFO = "meta/info.json"
DATA = "data/chunk-000/file-000.parquet"
EPISODES = "meta/episodes/chunk-000/file-000.parquet"


@pytest.fixture
def root(tmp_path: Path) -> Path:
    with DatasetWriter(
        tmp_path / "set", names=["a.pos", "b.pos"], cameras=[], fps=10, robot_type="x"
    ) as writer:
        for _ in range(2):
            for k in range(4):
                writer.add_frame(np.full(2, k), np.full(2, k), {})
            writer.end_episode("do it")
    return tmp_path / "set"


def info(**changes: Any) -> Callable[[Path], None]:
    def change(root: Path) -> None:
        document = json.loads((root / INFO).read_text())
        (root / INFO).write_text(json.dumps({**document, **changes}))

    return change


def text(name: str, content: str) -> Callable[[Path], None]:
    return lambda root: (root / name).write_text(content) and None


def missing(name: str) -> Callable[[Path], None]:
    return lambda root: (root / name).unlink()


def column(name: str, change: Callable[[list[Any]], list[Any] | None]) -> Callable[[Path], None]:
    def apply(root: Path) -> None:
        import pyarrow
        import pyarrow.parquet as parquet

        table = parquet.read_table(root / DATA)
        values = change(table.column(name).to_pylist())
        columns = {one: table.column(one).to_pylist() for one in table.column_names}
        columns = {**columns, name: values} if values is not None else columns
        if values is None:
            del columns[name]
        parquet.write_table(pyarrow.table(columns), root / DATA)

    return apply


@pytest.mark.parametrize(
    ("spoil", "words"),
    [
        (missing(INFO), "meta/info.json: it is missing: expected a LeRobot dataset"),
        (text(INFO, "{"), "info.json: expected a JSON object"),
        (info(codebase_version="v2.1"), "expected v3.0, got 'v2.1'; LeRobot converts older"),
        (info(fps=0), "fps: expected a number above 0, got 0"),
        (info(fps=20), "frame 3: timestamp 0.300 s, expected 0.150 s at 20 frames"),
        (info(features={}), "features.action.names: expected names, got None"),
        (info(data_path="{no}"), "data_path: got '{no}'"),
        (missing(EPISODES), "meta/episodes: no table of episodes is there"),
        (text(EPISODES, "no"), "expected a table with episode_index"),
        (missing(DATA), "file-000.parquet: it is missing"),
        (text(DATA, "PAR1 no PAR1"), "expected a table with action"),
        (column("action", lambda rows: [*rows[:2], [1.0, float("nan")], *rows[3:]]), "frame 2: b"),
        (column("action", lambda rows: [[1.0]] * len(rows)), "action: expected 2 numbers, got 1"),
        (column("action", lambda rows: [[1.0], *rows[1:]]), "expected numbers in every row"),
        (column("action", lambda rows: None), "expected a table with action"),
        (column("frame_index", lambda rows: [0] * len(rows)), "expected frames 0 to 3"),
        (column("episode_index", lambda rows: [1] * len(rows)), "expected frames 0 to 3, got 0"),
        (column("timestamp", lambda rows: [float("nan")] * len(rows)), "frame 0: timestamp nan"),
    ],
)
def test_a_dataset_that_is_not_whole_is_refused(
    root: Path, spoil: Callable[[Path], None], words: str
) -> None:
    spoil(root)
    with pytest.raises(DatasetUnusable) as caught:
        LeRobotDataset(root).episode(0)
    assert words in str(caught.value)


def test_an_episode_that_is_not_there_is_refused(root: Path) -> None:
    with pytest.raises(DatasetUnusable, match="no episode 2; there are 0 to 1"):
        LeRobotDataset(root).episode(2)
