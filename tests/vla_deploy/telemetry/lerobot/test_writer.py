"""Datasets are what LeRobot expects, to the column; what cannot be written leaves nothing."""

import json
import os
import warnings
from collections.abc import Callable
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from vla_deploy.telemetry.errors import DatasetRefused
from vla_deploy.telemetry.lerobot.reader import LeRobotDataset
from vla_deploy.telemetry.lerobot.writer import DatasetWriter

pytestmark = pytest.mark.usefixtures("needs_arrow")
NAMES = ("shoulder_pan.pos", "gripper.pos")
LENGTHS = (5, 8, 4)
TASKS = ("take it", "put it down", "take it")


def picture(level: int, width: int = 64) -> np.ndarray[Any, np.dtype[np.uint8]]:
    return np.full((48, width, 3), level, np.uint8)


def write(root: Path, names: tuple[str, ...] = NAMES, **more: Any) -> Path:
    with DatasetWriter(
        root, names=names, cameras=["front"], fps=10, robot_type="so_follower", **more
    ) as writer:
        for episode, (length, task) in enumerate(zip(LENGTHS, TASKS, strict=True)):
            for k in range(length):
                values = np.linspace(k, k + 1, len(names)) + 100 * episode
                writer.add_frame(values, values + 0.5, {"front": picture(20 * k + 5 * episode)})
            writer.end_episode(task)
    return root


def tables(root: Path) -> dict[str, Any]:
    import pyarrow.parquet as parquet

    return {str(one.relative_to(root)): parquet.read_table(one) for one in root.rglob("*.parquet")}


def test_a_dataset_has_the_files_and_columns_of_lerobot(tmp_path: Path) -> None:
    root = write(tmp_path / "set")
    info = json.loads((root / "meta/info.json").read_text())
    assert (info["codebase_version"], info["fps"], info["splits"]) == ("v3.0", 10, {"train": "0:3"})
    assert (info["total_episodes"], info["total_frames"], info["total_tasks"]) == (3, 17, 2)
    assert info["features"]["action"] == {"dtype": "float32", "shape": [2], "names": list(NAMES)}
    assert info["features"]["observation.images.front"]["shape"] == [48, 64, 3]
    found = tables(root)
    data = found["data/chunk-000/file-000.parquet"]
    types = {field.name: str(field.type) for field in data.schema}
    assert types == {
        "action": "fixed_size_list<element: float>[2]",
        "observation.state": "fixed_size_list<element: float>[2]",
        "timestamp": "float",
        **dict.fromkeys(("frame_index", "episode_index", "index", "task_index"), "int64"),
    }
    assert data.column("index").to_pylist() == list(range(17))
    assert data.column("task_index").to_pylist() == [0] * 5 + [1] * 8 + [0] * 4
    assert data.column("timestamp").to_pylist()[5:8] == pytest.approx([0.0, 0.1, 0.2])
    tasks = found["meta/tasks.parquet"]
    assert json.loads(tasks.schema.metadata[b"pandas"])["index_columns"] == ["task"]
    rows = found["meta/episodes/chunk-000/file-000.parquet"].to_pylist()
    assert [(row["dataset_from_index"], row["dataset_to_index"]) for row in rows] == [
        (0, 5),
        (5, 13),
        (13, 17),
    ]
    assert [row["videos/observation.images.front/from_timestamp"] for row in rows] == [0, 0.5, 1.3]
    assert rows[1]["tasks"] == ["put it down"]
    assert rows[1]["stats/action/max"] == [107.5, 108.5]
    assert np.shape(rows[1]["stats/observation.images.front/mean"]) == (3, 1, 1)
    stats = json.loads((root / "meta/stats.json").read_text())
    states = np.array(data.column("observation.state").to_pylist())
    for figure, expected in (("mean", states.mean(axis=0)), ("std", states.std(axis=0))):
        np.testing.assert_allclose(stats["observation.state"][figure], expected, rtol=1e-6)
    assert stats["action"]["count"] == [17]
    assert set(stats["action"]) == {
        *("min", "max", "mean", "std", "count", "q01", "q10", "q50", "q90", "q99")
    }
    levels = [20 * k + 5 * e for e, n in enumerate(LENGTHS) for k in range(n)]
    images = stats["observation.images.front"]
    np.testing.assert_allclose(np.ravel(images["mean"]), np.mean(levels) / 255)
    np.testing.assert_allclose(np.ravel(images["std"]), np.std(levels) / 255)
    np.testing.assert_allclose(np.ravel(images["max"]), max(levels) / 255)


def test_each_frame_of_the_video_is_where_lerobot_looks_for_it(tmp_path: Path) -> None:
    import av

    root = write(tmp_path / "set", video_file_mb=1e-5)  # every episode fills a file
    rows = tables(root)["meta/episodes/chunk-000/file-000.parquet"].to_pylist()
    for episode, row in enumerate(rows):
        key = "videos/observation.images.front"
        assert row[f"{key}/file_index"] == episode
        assert row[f"{key}/from_timestamp"] == 0.0
        file = root / f"{key}/chunk-000/file-{episode:03d}.mp4"
        with av.open(str(file)) as container:
            frames = list(container.decode(video=0))
        assert [frame.pts * frame.time_base for frame in frames] == [
            Fraction(k, 10) for k in range(LENGTHS[episode])
        ]
        shown = [int(frame.to_ndarray(format="rgb24")[20, 20, 0]) for frame in frames]
        assert shown == pytest.approx([20 * k + 5 * episode for k in range(len(shown))], abs=3)


def test_what_is_written_is_read_back_and_a_robot_of_one_joint_too(tmp_path: Path) -> None:
    for names in (NAMES, ("gripper.pos",)):
        dataset = LeRobotDataset(write(tmp_path / f"set{len(names)}", names))
        assert (dataset.fps, list(dataset.episodes), dataset.names) == (10.0, [0, 1, 2], names)
        episode = dataset.episode(1)
        assert episode.tasks == ("put it down",)
        assert episode.actions.shape == (8, len(names))
        np.testing.assert_allclose(episode.actions[:, 0], 100.5 + np.arange(8))


def nan(writer: DatasetWriter) -> None:
    writer.add_frame(np.array([0.0, np.nan]), np.zeros(2), {"front": picture(0)})


def other_size(writer: DatasetWriter) -> None:
    for width in (64, 32):
        writer.add_frame(np.zeros(2), np.zeros(2), {"front": picture(0, width)})


def odd_size(writer: DatasetWriter) -> None:
    writer.add_frame(np.zeros(2), np.zeros(2), {"front": picture(0, 33)})


def no_frames(writer: DatasetWriter) -> None:
    writer.end_episode("nothing")


def nothing(writer: DatasetWriter) -> None:
    pass


@pytest.mark.parametrize(
    ("act", "words"),
    [
        (nan, "frame 0: a state or action is not finite"),
        (other_size, "an image of 32 x 48, expected 64 x 48"),
        (odd_size, "images of 33 x 48: expected even numbers"),
        (no_frames, "it has no frames"),
        (nothing, "there is no episode to write"),
    ],
)
def test_what_cannot_be_written_leaves_nothing(
    tmp_path: Path, act: Callable[[DatasetWriter], None], words: str
) -> None:
    how = {"names": NAMES, "cameras": ["front"], "robot_type": "so_follower"}
    with (
        pytest.raises(DatasetRefused, match=words),
        DatasetWriter(tmp_path / "set", fps=10, **how) as writer,
    ):
        act(writer)
    assert list(tmp_path.iterdir()) == []


def test_a_dataset_that_is_there_is_not_touched(tmp_path: Path) -> None:
    (tmp_path / "set").mkdir()
    with pytest.raises(DatasetRefused, match="exists; name a folder that does not"):
        write(tmp_path / "set")
    with pytest.raises(DatasetRefused, match="fps: expected 1 to 120, got 0"):
        DatasetWriter(tmp_path / "other", names=NAMES, cameras=[], fps=0, robot_type="x")


def test_lerobot_itself_reads_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(os.environ, "HF_HUB_OFFLINE", "1")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        why = "asked where LeRobot is installed; scripts/lerobot-check does it in its own place"
        theirs = pytest.importorskip(
            "lerobot.datasets.lerobot_dataset", reason=why, exc_type=ImportError
        )
        dataset = theirs.LeRobotDataset(
            "local/set", root=write(tmp_path / "set"), video_backend="pyav"
        )
        frame = dataset[7]
    assert (dataset.num_episodes, len(dataset), frame["task"]) == (3, 17, "put it down")
    np.testing.assert_allclose(frame["action"].numpy(), [102.5, 103.5])
    assert float(frame["observation.images.front"][0, 20, 20]) * 255 == pytest.approx(45, abs=3)
